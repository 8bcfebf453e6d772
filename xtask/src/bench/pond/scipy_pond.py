"""The pond's floor by NumPy and SciPy: the paper's three convolutions as `scipy.signal.fftconvolve` sums them.

The job is a JSON file, its path the only argument; lengths are metres. Then each line of standard input is a request,
`{"out": path or null}`, and each line of standard output an answer with the milliseconds that passes 1 to 5 and that the sums took.
`out` gets the floor, [rows][columns] of f32, row 0 at the smallest y. Everything is float32, as on the other side of the race.
"""

import json
import sys
import time

import numpy as np
import scipy
import scipy.fft
import scipy.signal

JOB = json.load(open(sys.argv[1]))
F = np.float32
SIDE, EXTENT = JOB["side"], JOB["extent_m"]
PITCH = EXTENT / SIDE
DEPTH, ETA, EPSILON, N = JOB["depth_m"], JOB["eta"], JOB["extinction_per_m"], 2 * JOB["scattering"]
LIGHT = np.array(JOB["light"])
HEIGHTS = np.fromfile(JOB["heights"], "<f4").reshape(SIDE, SIDE)


def kernels():
    """The physical lobe about the vertical: what belongs to x, y and z."""
    radius = JOB["radius"]
    offset = np.arange(-radius, radius + 1) * PITCH
    x, y = np.meshgrid(offset, offset)
    r = np.sqrt(x * x + y * y + DEPTH * DEPTH)
    common = (N + 1) / (2 * np.pi) * DEPTH / r**3 * (DEPTH / r) ** (N - 1) * np.exp(-EPSILON * r)
    return [(common * component / r).astype(F) for component in (N * x, N * y, np.full_like(x, DEPTH))]


def slope(heights, axis):
    """Differences of both neighbours, inwards at the walls."""
    return np.gradient(heights, F(PITCH), axis=axis, edge_order=1)


def sources(heights):
    """Passes 1 to 5: flux times (-L_z)^(n - 1) times L_x, L_y and -L_z."""
    sx, sy = slope(heights, 1), slope(heights, 0)
    length = np.sqrt(1 + sx * sx + sy * sy)
    normal = (-sx / length, -sy / length, 1 / length)
    light = LIGHT.astype(F)
    cos_i = -(light[0] * normal[0] + light[1] * normal[1] + light[2] * normal[2])
    cos_t = np.sqrt(1 - (1 - cos_i * cos_i) / F(ETA * ETA))
    rs = (cos_i - F(ETA) * cos_t) / (cos_i + F(ETA) * cos_t)
    rp = (F(ETA) * cos_i - cos_t) / (F(ETA) * cos_i + cos_t)
    flux = cos_i * (1 - (rs * rs + rp * rp) / 2) * length * F(PITCH * PITCH)
    gamma = cos_i / F(ETA) - cos_t
    x, y, z = (light[k] / F(ETA) + gamma * normal[k] for k in range(3))
    power = flux * (-z) ** F(N - 1)
    return power * x, power * y, power * -z


def sums(images, kernels):
    return sum(scipy.signal.fftconvolve(image, kernel, mode="same") for image, kernel in zip(images, kernels))


def answer(content):
    print("PEER " + json.dumps(content), flush=True)


KERNELS = kernels()
with scipy.fft.set_workers(JOB["threads"]):
    sums(sources(HEIGHTS), KERNELS)
    answer({"scipy": scipy.__version__, "numpy": np.__version__})
    for line in sys.stdin:
        request = json.loads(line)
        start = time.perf_counter()
        images = sources(HEIGHTS)
        middle = time.perf_counter()
        floor = sums(images, KERNELS)
        end = time.perf_counter()
        if request["out"]:
            floor.astype("<f4").tofile(request["out"])
        answer({"surface_ms": 1e3 * (middle - start), "sums_ms": 1e3 * (end - middle)})
