"""Mitsuba 3's particle tracer, one wavelength at a time, at its best: an exact sphere, a beam just as wide, paths ended at the floor."""

import drjit as dr
import mitsuba as mi
import numpy as np

import protocol as p

mi.set_variant("llvm_ad_mono")
dr.set_thread_count(p.JOB["threads"])
T = mi.ScalarTransform4f

# The film is as wide as the eye's view straight down must be to have the receiver in it; only the receiver's part is kept. Every
# texel of the whole film counts as a photon.
WINDOWS = int(2 * p.WINDOWS_ASIDE + 1)
PHOTONS_PER_SAMPLE = WINDOWS * p.SIZE * p.SIZE

scene = mi.load_dict({
    "type": "scene",
    # Paths that have met the dark floor end by roulette, those in the glass do not.
    "integrator": {"type": "ptracer", "max_depth": 8, "rr_depth": 3},
    "light": {
        "type": "disk",
        "to_world": T().look_at(origin=list(p.CENTER - 3 * p.RADIUS * p.DIRECTION), target=p.CENTER, up=[0, 0, 1])
        @ T().scale(p.RADIUS),
        "emitter": {"type": "directionalarea",
                    "radiance": {"type": "uniform", "value": 1 / (np.pi * p.RADIUS**2)}},
    },
    "glass": {"type": "sphere", "center": p.CENTER, "radius": p.RADIUS,
              "bsdf": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}},
    "floor": {"type": "rectangle",
              "to_world": T().translate([p.WINDOW_X, 0, p.WINDOW_Z]) @ T().rotate([1, 0, 0], -90) @ T().scale(p.HALF),
              "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": p.ALBEDO}}},
    "eye": {
        "type": "perspective",
        "fov": 2 * np.degrees(np.arctan(p.HALF * WINDOWS / p.EYE[1])),
        "fov_axis": "x",
        "to_world": T().look_at(origin=p.EYE, target=[p.EYE[0], 0, p.EYE[2]], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": p.SIZE * WINDOWS, "height": p.SIZE, "crop_width": p.SIZE, "crop_height": p.SIZE,
                 "crop_offset_x": (WINDOWS - 1) * p.SIZE, "crop_offset_y": 0,
                 "pixel_format": "luminance", "component_format": "float32", "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    },
})
parameters = mi.traverse(scene)


def render(wavelength, photons, seed):
    parameters["glass.bsdf.eta"] = wavelength["ior"]
    parameters.update()
    samples = max(1, round(photons / PHOTONS_PER_SAMPLE))
    start = p.clock()
    image = mi.render(scene, spp=samples, seed=seed).numpy()
    took = p.clock() - start
    # Seen from above with z upwards, both axes run backwards.
    return image[::-1, ::-1, 0].astype(float), took, samples * PHOTONS_PER_SAMPLE


# Compile. A kernel is kept by its code, which is the same for every index of refraction.
render({"ior": 1.5}, 1, 0)
render({"ior": 1.6}, 1, 1)
p.serve({"name": "Mitsuba", "version": mi.__version__,
         "how": f"ptracer, {mi.variant()}, Dr.Jit {dr.__version__}, exact sphere"}, render)
