//! Real time: light, camera and glass move every frame. Executors include this beside their `device`, which makes them.

use asm_core::moving::{self, MovingFrames};
use asm_core::{AsmRenderer, Method, PASSES, Settings, UpdateError, Updated, render_plan};
use frame_plan::Executor;
use spectral_scene::{Mesh, Scene};

use crate::device;

const SIZE: [u32; 2] = [64, 64];

/// The bundled sphere with a tenth of its faces: software devices spend a frame on them.
fn scene() -> Scene {
    let mut scene = spectral_scene::bundled("sphere").unwrap();
    let glass = scene.refractors().next().unwrap();
    let mesh = &mut scene.meshes[scene.objects[glass].mesh];
    *mesh = sphere(glam::Vec3::from(mesh.positions[0]).length());
    scene
}

/// A sphere round the origin, smooth, of 24 meridians and 12 zones.
fn sphere(radius: f32) -> Mesh {
    let (zones, meridians) = (12_u32, 24_u32);
    let normal = |zone: u32, meridian: u32| {
        let (sin_polar, cos_polar) = (std::f32::consts::PI * zone as f32 / zones as f32).sin_cos();
        let (sin, cos) = (std::f32::consts::TAU * meridian as f32 / meridians as f32).sin_cos();
        [sin_polar * cos, cos_polar, sin_polar * sin]
    };
    let south = 1 + (zones - 1) * meridians;
    let between = (1..zones).flat_map(|zone| (0..meridians).map(move |meridian| normal(zone, meridian)));
    let normals: Vec<[f32; 3]> =
        std::iter::once([0.0, 1.0, 0.0]).chain(between).chain([[0.0, -1.0, 0.0]]).collect();
    let at = |zone: u32, meridian: u32| 1 + (zone - 1) * meridians + meridian % meridians;
    let triangles = (0..meridians).flat_map(|m| {
        let middle = (1..zones - 1).flat_map(move |z| {
            let [a, b, c, d] = [at(z, m), at(z, m + 1), at(z + 1, m + 1), at(z + 1, m)];
            [[a, b, c], [a, c, d]]
        });
        let caps = [[0, at(1, m + 1), at(1, m)], [south, at(zones - 1, m), at(zones - 1, m + 1)]];
        middle.chain(caps)
    });
    Mesh {
        name: "sphere".into(),
        positions: normals.iter().map(|normal| normal.map(|v| v * radius)).collect(),
        triangles: triangles.collect(),
        normals,
        ..Mesh::default()
    }
}

/// Small, so that software devices are through in time.
fn settings() -> Settings {
    Settings {
        wavelengths: Some(3),
        emission_size: 32,
        map_size: Some(64),
        picture_samples: 1,
        bake_samples: 2,
        ..Settings::of(Method::CausticsMap)
    }
}

fn frames(scene: &Scene, frames: u32) -> MovingFrames {
    MovingFrames { frames, picture: SIZE, receiver: scene.receiver("receiver").unwrap(), texels: [32, 32] }
}

/// The caustic's total is the light that the emission view's texels carry into the sphere. As it moves across the grid, about
/// 8 r texels at its silhouette, of r texels radius, fall inside or outside: the count of all pi r^2 is uncertain by
/// sqrt(8 r / 12), and a second difference by sqrt(1 + 4 + 1) times that. The largest of 300 is within 4 of these.
fn largest_change_of_total(photons_per_wavelength: f64) -> f64 {
    let r = (photons_per_wavelength / std::f64::consts::PI).sqrt();
    4.0 * 6_f64.sqrt() * (8.0 * r / 12.0).sqrt() / photons_per_wavelength
}

#[test]
fn three_hundred_moving_frames_make_nothing_and_keep_their_light() {
    let Some(mut executor) = device::executor(PASSES) else { return };
    let scene = scene();
    let run = moving::run(&mut executor, &scene, &settings(), &frames(&scene, 300)).unwrap();
    assert_eq!(run.made, run.made_by_second, "frames 3 to 300 make nothing");
    assert!(run.made.buffers > 0 && run.made.textures > 0 && run.made.bytes > 0, "{:?}", run.made);

    let bands = run.statistics.lights[0].wavelengths_nm.len() as f64;
    let bound = largest_change_of_total(run.statistics.photons as f64 / bands);
    assert!(bound < 0.05, "the bound says something: {bound}");
    assert!(run.total_y.max <= bound, "{:?}, bound {bound}", run.total_y);
    assert!(run.texel_y.mean > run.total_y.mean && run.texel_y.max.is_finite(), "{run:?}");

    // Negative control: to and fro between two places.
    let phases = (0..6).map(|frame| f64::from(frame % 2) * 0.25);
    let (_, texel, _) =
        moving::flicker(&mut executor, &scene, &settings(), &frames(&scene, 6), phases).unwrap();
    assert!(texel.mean > 3.0 * run.texel_y.mean, "{texel:?} {:?}", run.texel_y);
}

/// Cells that are split make no buffers: queues have their sizes from the plan.
#[test]
fn moving_footprints_make_nothing_and_keep_their_light() {
    let Some(mut executor) = device::executor(PASSES) else { return };
    let scene = scene();
    let footprints = Settings {
        method: Method::Footprint,
        emission_size: 24,
        cell_splits: 2,
        map_size: Some(32),
        ..settings()
    };
    let run = moving::run(&mut executor, &scene, &footprints, &frames(&scene, 8)).unwrap();
    assert_eq!(run.made, run.made_by_second, "frames 3 to 8 make nothing");
    assert!(run.made.buffers > 0 && run.made.bytes > 0, "{:?}", run.made);
    assert!(run.statistics.lights[0].ledgers.iter().all(|ledger| ledger.balances()), "{:?}", run.statistics);
    // The sphere's rim is known to a quarter of a cell, where photons know it to a whole one.
    let cells = std::f64::consts::PI * (0.5 * f64::from(footprints.emission_size)).powi(2);
    let bound = largest_change_of_total(cells) / 4.0;
    assert!(run.total_y.max <= bound, "{:?}, bound {bound}", run.total_y);

    // Negative control: to and fro between two places.
    let phases = (0..6).map(|frame| f64::from(frame % 2) * 0.25);
    let (_, texel, _) =
        moving::flicker(&mut executor, &scene, &footprints, &frames(&scene, 6), phases).unwrap();
    assert!(texel.mean > 2.0 * run.texel_y.mean, "{texel:?} {:?}", run.texel_y);
}

#[test]
fn plans_made_anew_and_other_structures_are_seen() {
    let Some(executor) = device::executor(PASSES) else { return };
    let mut renderer = AsmRenderer::new(executor);
    let mut scene = scene();
    assert_eq!(renderer.update(&scene, 0, SIZE, &settings()).unwrap(), Updated::Prepared);
    (0..2).for_each(|_| renderer.execute().unwrap());
    let before = renderer.executor().made();
    scene.lights[0].intensity *= 0.5;
    assert_eq!(renderer.update(&scene, 0, SIZE, &settings()).unwrap(), Updated::Moved);
    renderer.execute().unwrap();
    assert_eq!(renderer.executor().made(), before);

    // The same scene in a plan made anew: the pipelines are there, the resources are made again.
    renderer.prepare(&scene, 0, SIZE, &settings()).unwrap();
    let anew = renderer.executor().made();
    assert_eq!(anew.pipelines, before.pipelines);
    assert!(anew.buffers > before.buffers && anew.textures > before.textures && anew.bytes > before.bytes);

    // Another mesh, and another size.
    let current = renderer.prepared().unwrap().clone();
    let floor = scene.objects[0].mesh;
    scene.meshes[floor].triangles.truncate(1);
    let limits = renderer.executor().limits();
    let next = render_plan(&scene, 0, SIZE, &settings(), &limits).unwrap();
    let error = current.clone().update(renderer.executor(), next).unwrap_err();
    assert!(matches!(error, UpdateError::StructureChanged { .. }), "{error}");
    assert_eq!(renderer.update(&scene, 0, SIZE, &settings()).unwrap(), Updated::Prepared);
    assert_eq!(renderer.update(&scene, 0, [32, 64], &settings()).unwrap(), Updated::Prepared);
    renderer.execute().unwrap();
}
