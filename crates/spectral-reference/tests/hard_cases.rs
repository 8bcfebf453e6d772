//! Scenes at the edge of what makes sense, and requests beyond it.

mod stage;

use glam::{DMat4, DVec3};
use spectral_reference::{BakeSettings, Effort, ReferenceError, bake};
use spectral_scene::{LightShape, Scene};
use stage::*;

/// A ball over a floor, lit at an angle.
fn ball(n: f64) -> (Stage, usize) {
    let mut stage = Stage::new();
    let floor = stage.floor([0.1, 0.05], 0.25, 0.0);
    stage.add(sphere(24), glass(n), placed([0.0, 0.2, 0.0], [0.1; 3]));
    stage.sun([0.3, -1.0, 0.2]);
    (stage, floor)
}

#[test]
fn threads_do_not_change_a_bit() {
    let (stage, floor) = ball(1.5);
    let with =
        |threads| baked(&stage.0, floor, &BakeSettings { threads: Some(threads), ..settings(32, 40_000) });
    let (one, three) = (with(1), with(3));
    assert_eq!(one.maps, three.maps);
    assert_eq!(one.refracted, three.refracted);
    assert_eq!(one.ledger, three.ledger);
    assert_eq!(one.standard_error, three.standard_error);
    let other = baked(&stage.0, floor, &BakeSettings { seed: 1, ..settings(32, 40_000) });
    assert_ne!(one.refracted, other.refracted);
}

/// The same scene in millimetres and at ten kilometres gives the same light.
#[test]
fn scale_does_not_matter() {
    let (stage, floor) = ball(1.5);
    let unit = baked(&stage.0, floor, &settings(64, 100_000));
    for scale in [1e-3, 1e4] {
        let mut scene = stage.0.clone();
        for object in &mut scene.objects {
            object.world_from_mesh = DMat4::from_scale(DVec3::splat(scale)) * object.world_from_mesh;
        }
        let scaled = baked(&scene, floor, &settings(64, 100_000));
        assert!(relative_rms(&scaled.refracted, &unit.refracted) < 1e-3, "{scale}");
        assert_close(mean(&scaled.refracted, 1), mean(&unit.refracted, 1), 1e-6, "refracted");
        assert_close(mean(&scaled.direct, 1), mean(&unit.direct, 1), 1e-6, "direct");
        assert_close(mean(&scaled.reflected, 1), mean(&unit.reflected, 1), 1e-4, "reflected");
    }
}

/// Far from the origin there are fewer digits for the same shapes; the light stays.
#[test]
fn an_offset_of_a_thousand_sizes_does_not_matter() {
    let (stage, floor) = ball(1.5);
    let near = baked(&stage.0, floor, &settings(32, 100_000));
    let mut scene = stage.0.clone();
    for object in &mut scene.objects {
        object.world_from_mesh =
            DMat4::from_translation(DVec3::new(300.0, -100.0, 200.0)) * object.world_from_mesh;
    }
    let far = baked(&scene, floor, &settings(32, 100_000));
    assert!(relative_rms(&far.refracted, &near.refracted) < 2e-2);
    assert_close(mean(&far.refracted, 1), mean(&near.refracted, 1), 1e-3, "refracted");
    assert_close(mean(&far.direct, 1), mean(&near.direct, 1), 1e-3, "direct");
}

/// Glass of index 1 moves light from one layer to another and nothing else.
#[test]
fn index_one_is_no_glass() {
    let (stage, floor) = ball(1.0);
    let bake = baked(&stage.0, floor, &settings(64, 2_000_000));
    let bare = Scene { objects: stage.0.objects[..1].to_vec(), ..stage.0.clone() };
    let unblocked = baked(&bare, floor, &settings(64, 1));
    let sum: Vec<[f64; 3]> =
        bake.direct.iter().zip(&bake.refracted).map(|(a, b)| [0, 1, 2].map(|c| a[c] + b[c])).collect();
    assert!(mean(&bake.refracted, 1) > 0.05);
    for c in 0..3 {
        assert_close(mean(&sum, c), mean(&unblocked.direct, c), 2e-4, "flux");
    }
    assert!(relative_rms(&sum, &unblocked.direct) < 0.02);
    assert_eq!(mean(&bake.reflected, 1), 0.0);
    let total = bake.ledger.total();
    assert_eq!((total.reflected, total.lost()), (0.0, 0.0));
}

/// An index barely above 1 deflects and reflects barely: no cancellation, no loss.
#[test]
fn an_index_slightly_above_one_is_nearly_no_glass() {
    let flux = |n| {
        let (mut stage, floor) = ball(n);
        // Flat: a smooth normal that leans away from the light at the rim loses it.
        stage.0.meshes[1].normals.clear();
        mean(&baked(&stage.0, floor, &settings(32, 200_000)).refracted, 1)
    };
    assert_close(flux(1.000_001), flux(1.0), 1e-4, "refracted");
}

#[test]
fn an_empty_scene_is_an_unknown_receiver() {
    let error = bake(&Scene::default(), 0, &settings(8, 100), &|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "receiver 0 does not exist, the scene has 0 objects");
}

#[test]
fn without_light_or_glass_there_is_only_what_there_is() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 1.0, 0.0);
    let dark = baked(&stage.0, floor, &settings(8, 100));
    assert_eq!((mean(&dark.direct, 1), dark.photons), (0.0, 0));
    assert_eq!(dark.standard_error.total, 0.0);
    stage.sun([0.0, -1.0, 0.0]);
    let lit = baked(&stage.0, floor, &BakeSettings { effort: Effort::noise(1e-4), ..settings(8, 1) });
    assert!(lit.direct.iter().all(|xyz| (xyz[1] - 1.0).abs() < 1e-12));
    assert_eq!(lit.maps.direct[0], lit.direct[0].map(|v| v as f32));
    assert_eq!(lit.photons, 0);
    // A scene of nothing but glass has no receiver, but is no reason to fail either.
    let (mut only_glass, _) = ball(1.5);
    only_glass.0.objects.remove(0);
    let error = bake(&only_glass.0, 0, &settings(8, 100), &|_| ()).unwrap_err();
    assert!(matches!(error, ReferenceError::ReceiverRefracts { .. }), "{error}");
}

#[test]
fn a_receiver_lit_from_behind_is_dark() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 1.0, 0.0);
    stage.add(sphere(8), glass(1.5), placed([0.0, 0.5, 0.0], [0.1; 3]));
    stage.add(sphere(8), glass(1.5), placed([0.0, -0.5, 0.0], [0.1; 3]));
    stage.sun([0.0, 1.0, 0.0]);
    stage.light(LightShape::Point { position_m: DVec3::new(0.0, -1.0, 0.0), range_m: None }, 1.0);
    let bake = baked(&stage.0, floor, &settings(8, 40_000));
    assert_eq!([&bake.direct, &bake.refracted, &bake.reflected].map(|l| mean(l, 1)), [0.0; 3]);
    // The light is there: it lands on the back.
    assert!(bake.ledger.total().landed_elsewhere > 0.0);
    // `double_sided` is about what a camera sees.
    let material = stage.0.objects[floor].material;
    stage.0.materials[material].double_sided = !stage.0.materials[material].double_sided;
    assert_eq!(baked(&stage.0, floor, &settings(8, 40_000)).maps, bake.maps);
}

#[test]
fn a_refractor_outside_a_spot_does_nothing() {
    let (mut stage, floor) = ball(1.5);
    stage.0.lights.clear();
    stage.light(
        LightShape::Spot {
            position_m: DVec3::new(0.0, 1.0, 0.0),
            direction: DVec3::new(0.9, -1.0, 0.0).normalize(),
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.3,
            range_m: None,
        },
        1.0,
    );
    let bake = baked(&stage.0, floor, &settings(16, 40_000));
    assert_eq!((mean(&bake.refracted, 1), mean(&bake.reflected, 1)), (0.0, 0.0));
    assert_eq!(bake.ledger.total().emitted, 0.0);
}

/// A cube with four faces exactly along the light: they catch nothing, the top catches its area.
#[test]
fn light_parallel_to_faces_meets_only_the_others() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 0.5, 0.0);
    stage.add(cube(), glass(1.5), placed([0.0, 0.5, 0.0], [0.2; 3]));
    stage.sun([0.0, -1.0, 0.0]);
    let bake = baked(&stage.0, floor, &settings(20, 400_000));
    let total = bake.ledger.total();
    assert_close(total.emitted - total.passed, 0.16, 1e-4, "flux on the top");
    let r = fresnel(1.0, 1.5);
    let transmitted = mean(&bake.refracted, 1);
    assert_close(transmitted, 0.16 * (1.0 - r).powi(2) * (1.0 + r * r), 1e-4, "flux through the bottom");
    assert_eq!(total.lost() - total.truncated, 0.0);
}

/// Standing exactly on the floor is the same as standing just above it.
#[test]
fn touching_surfaces_are_passed_in_order() {
    let flux = |gap: f64| {
        let mut stage = Stage::new();
        let floor = stage.floor([0.0, 0.0], 0.5, 0.0);
        stage.add(cube(), glass(1.5), placed([0.0, 0.2 + gap, 0.0], [0.2; 3]));
        stage.sun([0.3, -1.0, 0.1]);
        let bake = baked(&stage.0, floor, &settings(20, 200_000));
        (mean(&bake.refracted, 1), mean(&bake.direct, 1))
    };
    let (touching, above) = (flux(0.0), flux(1e-7));
    assert_close(touching.0, above.0, 1e-5, "refracted");
    assert_close(touching.1, above.1, 1e-5, "direct");
}

/// Two plates that share a surface are in optical contact, whichever comes first in the scene; the least gap keeps
/// them apart.
#[test]
fn touching_plates_are_in_optical_contact() {
    let (upper, lower) = (1.9, 1.5);
    let flux = |gap: f64, upper_first: bool| {
        let mut stage = Stage::new();
        let floor = stage.floor([0.0, 0.0], 0.5, 0.0);
        let mut plates = [(lower, 0.3), (upper, 0.4 + gap)];
        if upper_first {
            plates.reverse();
        }
        for (n, y) in plates {
            stage.add(cube(), glass(n), placed([0.0, y, 0.0], [1.0, 0.05, 1.0]));
        }
        stage.sun([0.0, -1.0, 0.0]);
        let settings = BakeSettings { bounces: 0, ..settings(8, 200_000) };
        mean(&baked(&stage.0, floor, &settings).refracted, 1)
    };
    let through = |n: f64| 1.0 - fresnel(1.0, n);
    for upper_first in [false, true] {
        let contact = through(upper) * through(upper / lower) * through(lower);
        assert_close(flux(0.0, upper_first), contact, 1e-3, "contact");
        let gap = (through(upper) * through(lower)).powi(2);
        assert_close(flux(1e-7, upper_first), gap, 1e-3, "gap");
    }
}

/// Glass within glass of the same index is one piece of glass.
#[test]
fn a_body_of_equal_index_inside_another_is_invisible() {
    let flux = |inner: bool| {
        let mut stage = Stage::new();
        let floor = stage.floor([0.0, 0.0], 0.5, 0.0);
        stage.add(cube(), glass(1.5), placed([0.0, 0.5, 0.0], [0.3; 3]));
        if inner {
            stage.add(sphere(16), glass(1.5), placed([0.0, 0.5, 0.0], [0.2; 3]));
            stage.add(cube(), glass(1.5), placed([0.1, 0.6, 0.0], [0.25; 3]));
        }
        stage.sun([0.3, -1.0, 0.2]);
        let bake = baked(&stage.0, floor, &settings(16, 200_000));
        (mean(&bake.refracted, 1), mean(&bake.direct, 1))
    };
    let (one, several) = (flux(false), flux(true));
    // The third body pokes out at the top, where light meets it first at another height: shifted, not more.
    assert_close(several.0, one.0, 0.2, "refracted");
    assert!(several.0 > 0.05);
}

#[test]
fn bad_meshes_have_defined_effects() {
    let (stage, floor) = ball(1.5);
    let good = baked(&stage.0, floor, &settings(32, 100_000));
    assert_eq!(good.geometry.open_refractors, 0);

    let mut inside_out = stage.0.clone();
    inside_out.meshes[1].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let bake = baked(&inside_out, floor, &settings(32, 100_000));
    assert_eq!(bake.geometry.inside_out_refractors, 1);
    assert_close(mean(&bake.refracted, 1), mean(&good.refracted, 1), 1e-6, "inside out");
    // What the loader makes of it is the same.
    inside_out.turn_outwards();
    assert_eq!(inside_out, stage.0);

    let mut repeated = stage.0.clone();
    let twice = repeated.meshes[1].triangles.clone();
    repeated.meshes[1].triangles.extend(&twice);
    repeated.meshes[1].triangles.extend(twice.iter().map(|&[a, _, c]| [a, c, c]));
    let bake = baked(&repeated, floor, &settings(32, 100_000));
    assert_eq!(bake.geometry.duplicates, twice.len() as u64);
    assert_eq!(bake.geometry.zero_area, twice.len() as u64);
    assert_eq!(bake.maps, good.maps);

    // Half of the ball is missing: an open refractor, light inside never gets out unless it lands.
    let mut open = stage.0.clone();
    open.meshes[1].triangles.truncate(twice.len() / 2);
    let bake = baked(&open, floor, &settings(32, 100_000));
    assert_eq!(bake.geometry.open_refractors, 1);
    assert!(mean(&bake.refracted, 1) > 0.0);
}

#[test]
fn one_texel_takes_everything() {
    let (stage, floor) = ball(1.5);
    let one = baked(&stage.0, floor, &settings(1, 100_000));
    let many = baked(&stage.0, floor, &settings(64, 100_000));
    assert_close(one.refracted[0][1], mean(&many.refracted, 1), 1e-9, "refracted");
    assert_close(one.direct[0][1], mean(&many.direct, 1), 2e-2, "direct");
}

/// A receiver of two triangles whose UVs are stretched and mirrored still counts flux per area.
#[test]
fn distorted_uvs_keep_the_irradiance() {
    let (mut stage, floor) = ball(1.5);
    let straight = baked(&stage.0, floor, &settings(32, 100_000));
    stage.0.meshes[0].uvs = vec![[0.9, 0.0], [0.7, 0.8], [0.0, 1.0], [0.1, 0.2]];
    let bent = baked(&stage.0, floor, &settings(32, 100_000));
    // Unlit by glass the irradiance is the sun's, whatever the layout, and no texel beside the mesh has any.
    let most = bent.direct.iter().map(|xyz| xyz[1]).fold(0.0, f64::max);
    let full = straight.direct.iter().map(|xyz| xyz[1]).fold(0.0, f64::max);
    assert_close(most, full, 1e-9, "unblocked texels");
    let empty = bent.direct.iter().filter(|xyz| xyz[1] == 0.0).count();
    assert!(empty > 200, "{empty}");
    let (a, b) = (straight.ledger.total().landed, bent.ledger.total().landed);
    assert_close(b, a, 1e-9, "landed flux");
}

/// The error that a bake states is the error that it has.
#[test]
fn the_standard_error_is_honest() {
    let (stage, floor) = ball(1.5);
    let bakes: Vec<_> =
        (0..6).map(|seed| baked(&stage.0, floor, &BakeSettings { seed, ..settings(64, 150_000) })).collect();
    let stated = bakes.iter().map(|b| b.standard_error.refracted).sum::<f64>() / bakes.len() as f64;
    let n = bakes.len() as f64;
    let texels = bakes[0].refracted.len();
    let (mut variance, mut signal) = (0.0, 0.0);
    for texel in 0..texels {
        let values: Vec<f64> = bakes.iter().map(|b| b.refracted[texel][1]).collect();
        let mean = values.iter().sum::<f64>() / n;
        variance += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        signal += mean * mean;
    }
    let found = (variance / signal).sqrt();
    assert_close(stated, found, 0.1, "standard error");
}

#[test]
fn a_noise_target_is_reached_and_progress_rises_to_one() {
    let (stage, floor) = ball(1.5);
    let heard = std::sync::Mutex::new(vec![]);
    let settings = BakeSettings { effort: Effort::noise(0.02), ..settings(32, 1) };
    let bake = bake(&stage.0, floor, &settings, &|p| heard.lock().unwrap().push(p)).unwrap();
    assert!(bake.standard_error.refracted <= 0.02 && bake.standard_error.total <= 0.02);
    let heard = heard.into_inner().unwrap();
    assert!(heard.windows(2).all(|w| w[0] <= w[1]), "{heard:?}");
    assert_eq!((heard.first(), heard.last()), (Some(&0.0), Some(&1.0)));
    let impossible = |max_photons, max_rays| {
        let effort = Effort::Noise { relative: 1e-6, max_photons, max_rays };
        baked(&stage.0, floor, &BakeSettings { effort, ..settings })
    };
    assert!(impossible(50_000, u64::MAX).photons <= 50_000);
    let most_rays = 2_000_000;
    let rays = impossible(u64::MAX, most_rays).ledger.counts.rays;
    assert!(rays > most_rays / 2 && rays < most_rays + most_rays / 50, "{rays}");
}

#[test]
fn bad_requests_say_what_would_be_right() {
    let (mut stage, floor) = ball(1.5);
    let fails = |scene: &Scene, object, settings: &BakeSettings| {
        bake(scene, object, settings, &|_| ()).unwrap_err().to_string()
    };
    let good = settings(8, 100);
    for (wrong, message) in [
        (BakeSettings { size: [0, 8], ..good }, "size is 0 x 8; both must be 1 to 8192"),
        (BakeSettings { step_nm: 10.0, ..good }, "step_nm is 10; it must be 1 to 5"),
        (BakeSettings { step_nm: f64::NAN, ..good }, "step_nm is NaN; it must be 1 to 5"),
        (BakeSettings { effort: Effort::Photons(0), ..good }, "photons is 0; it must be at least 1"),
        (BakeSettings { effort: Effort::noise(0.0), ..good }, "noise is 0; it must be above 0 and below 1"),
        (BakeSettings { bounces: 5000, ..good }, "bounces is 5000; it must be at most 1000"),
        (BakeSettings { direct_samples: 0, ..good }, "direct_samples is 0; it must be at least 1"),
    ] {
        assert_eq!(fails(&stage.0, floor, &wrong), message);
    }
    assert_eq!(fails(&stage.0, 7, &good), "receiver 7 does not exist, the scene has 2 objects");
    assert_eq!(fails(&stage.0, 1, &good), "`sphere` refracts, a receiver is opaque");
    stage.0.meshes[0].uvs.clear();
    assert_eq!(fails(&stage.0, floor, &good), "`receiver` has no texture coordinates to bake onto");
    stage.0.meshes[0].positions[0][0] = f32::NAN;
    let error = bake(&stage.0, floor, &good, &|_| ()).unwrap_err();
    assert!(!error.to_string().is_empty());
}
