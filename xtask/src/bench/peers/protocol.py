"""What both peers share: the job they are given, the camera, and how they are asked.

The job is a JSON file, its path the only argument; all lengths in it are millimetres. Then each line of standard input is a request,
`{"photons": per wavelength, "seed": n, "out": path}`, and each line of standard output an answer. `out` gets the picture of the
receiver, [rows][columns][XYZ] of f64, row 0 at -z and column 0 at -x.
"""

import json
import os
import sys

import numpy as np

JOB = json.load(open(sys.argv[1]))
CENTER, RADIUS = JOB["center"], JOB["radius"]
DIRECTION = np.array(JOB["direction"])
(WINDOW_X, WINDOW_Z), HALF = JOB["window"], JOB["half"]
SIZE = JOB["size"]

# The eye looks straight down beside the glass, so that a part of its picture is the receiver's texels and no glass stands before them.
WINDOWS_ASIDE = 2.5
EYE = [WINDOW_X + WINDOWS_ASIDE * 2 * HALF, 150.0, WINDOW_Z]

# Dark enough that nothing returns from the receiver by way of the glass.
ALBEDO = 0.01


def clock():
    """Seconds on the wall, and of all threads."""
    times = os.times()
    return np.array([times.elapsed, times.user + times.system])


def serve(versions, render):
    """Answer requests; `render(wavelength, photons, seed)` returns [rows][columns], [seconds, CPU seconds] and photons."""
    answer(versions)
    for line in sys.stdin:
        request = json.loads(line)
        xyz, seconds, photons = np.zeros((SIZE, SIZE, 3)), np.zeros(2), 0
        for i, wavelength in enumerate(JOB["wavelengths"]):
            seed = request["seed"] * len(JOB["wavelengths"]) + i + 1
            image, took, sent = render(wavelength, request["photons"], seed)
            xyz += image[..., None] * np.array(wavelength["xyz"])
            seconds, photons = seconds + took, photons + sent
        xyz.astype("<f8").tofile(request["out"])
        answer({"photons": int(photons), "seconds": float(seconds[0]), "cpu_seconds": float(seconds[1])})


def answer(content):
    """One line, marked: libraries print, too."""
    print("PEER " + json.dumps(content), flush=True)
