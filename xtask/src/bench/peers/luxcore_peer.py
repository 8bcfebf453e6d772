"""LuxCore's light tracer, one wavelength at a time (its own dispersion is no reference), a beam just as wide as the glass."""

import time
from importlib.metadata import version

import numpy as np
import pyluxcore

import protocol as p

pyluxcore.Init()
pyluxcore.SetLogHandler(lambda message: None)

# Of the sphere, from pole to pole; normals are smooth.
RINGS = 128


def properties(values):
    all_of_them = pyluxcore.Properties()
    for name, value in values.items():
        all_of_them.Set(pyluxcore.Property(name, value))
    return all_of_them


def sphere():
    """Unit vectors and triangles."""
    around = 2 * RINGS
    polar, azimuth = np.meshgrid(np.pi * np.arange(RINGS + 1) / RINGS, 2 * np.pi * np.arange(around) / around, indexing="ij")
    vectors = np.stack([np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)], -1).reshape(-1, 3)
    triangles = []
    for ring in range(RINGS):
        for i in range(around):
            a, b = ring * around + i, ring * around + (i + 1) % around
            triangles += [(a, b + around, b)] if ring > 0 else []
            triangles += [(a, a + around, b + around)] if ring < RINGS - 1 else []
    return vectors, triangles


def rows(array):
    return [tuple(map(float, row)) for row in array]


vectors, triangles = sphere()
scene = pyluxcore.Scene()
scene.DefineMesh("ball", rows(np.array(p.CENTER) + p.RADIUS * vectors), triangles, rows(vectors), None, None, None)
corners = [(p.WINDOW_X + x * p.HALF, 0.0, p.WINDOW_Z + z * p.HALF) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
scene.DefineMesh("floor", corners, [(0, 2, 1), (0, 3, 2)], None, None, None, None)
# At 90 degrees of view the window's units are tangents; across, the picture runs from +x to -x.
# Light tracing writes one row below what eye rays see there, so the window is a texel lower.
TEXEL = 2 * p.HALF / p.SIZE / p.EYE[1]
near, far = ((side * p.HALF + p.EYE[0] - p.WINDOW_X) / p.EYE[1] for side in (-1, 1))
scene.Parse(properties({
    "scene.materials.glass.type": "glass", "scene.materials.glass.kt": [1.0] * 3, "scene.materials.glass.kr": [1.0] * 3,
    "scene.materials.glass.interiorior": 1.5, "scene.materials.glass.exteriorior": 1.0,
    "scene.materials.grey.type": "matte", "scene.materials.grey.kd": [p.ALBEDO] * 3,
    "scene.objects.ball.shape": "ball", "scene.objects.ball.material": "glass",
    "scene.objects.floor.shape": "floor", "scene.objects.floor.material": "grey",
    "scene.lights.beam.type": "laser", "scene.lights.beam.radius": float(p.RADIUS),
    "scene.lights.beam.position": (p.CENTER - 3 * p.RADIUS * p.DIRECTION).tolist(), "scene.lights.beam.target": p.CENTER,
    "scene.lights.beam.gain": [1.0] * 3,
    "scene.camera.type": "perspective", "scene.camera.fieldofview": 90.0, "scene.camera.up": [0.0, 0.0, 1.0],
    "scene.camera.lookat.orig": p.EYE, "scene.camera.lookat.target": [p.EYE[0], 0.0, p.EYE[2]],
    "scene.camera.screenwindow": [near, far, -p.HALF / p.EYE[1] - TEXEL, p.HALF / p.EYE[1] - TEXEL],
    "scene.camera.autofocus.enable": False, "scene.camera.autovolume.enable": False,
}))
SETTINGS = {
    "renderengine.type": "LIGHTCPU", "sampler.type": "RANDOM", "native.threads.count": p.JOB["threads"],
    "light.maxdepth": 9, "path.maxdepth": 9, "light.russianroulette.depth": 3, "path.russianroulette.depth": 3,
    "film.width": p.SIZE, "film.height": p.SIZE, "film.filter.type": "NONE",
    "film.outputs.0.type": "RGB", "film.outputs.0.filename": "unused.exr",
}


def render(wavelength, photons, seed):
    scene.Parse(properties({
        "scene.materials.glass.type": "glass", "scene.materials.glass.kt": [1.0] * 3, "scene.materials.glass.kr": [1.0] * 3,
        "scene.materials.glass.interiorior": wavelength["ior"], "scene.materials.glass.exteriorior": 1.0,
    }))
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties({**SETTINGS, "renderengine.seed": seed}), scene))
    session.Start()
    start, sent = p.clock(), 0.0
    while sent < photons:
        time.sleep(0.005)
        session.UpdateStats()
        sent = session.GetStats().Get("stats.renderengine.total.samplecount").GetFloat()
    took = p.clock() - start
    session.Stop()
    rgb = np.empty((p.SIZE, p.SIZE, 3), np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, rgb, 0)
    # Rows come from below, columns from +x.
    return rgb[:, ::-1, 1].astype(float), took, sent


p.serve({"name": "LuxCore", "version": version("pyluxcore"),
         "how": f"LIGHTCPU, sphere of {len(triangles)} faces with smooth normals"}, render)
