//! Where lights stand, and several of them.

use asm_core::{Method, PlanError, Settings};
use glam::DVec3;
use spectral_scene::LightShape;

use crate::stage::*;

fn few() -> Settings {
    Settings { emission_size: 128, ..Settings::of(Method::CausticsMap) }
}

#[test]
fn a_refractor_outside_the_cone_stays_dark() {
    // The spot shines up, the plate is below it.
    let shape = LightShape::Spot {
        position_m: DVec3::Y * 0.8,
        direction: DVec3::Y,
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.4,
        range_m: None,
    };
    let scene = plate_over_floor(glass(1.5), 0.4, light(shape, 1.0));
    for prune in [true, false] {
        let (maps, statistics) = bake(&scene, 16, &Settings { prune, ..few() });
        assert_eq!(total(&maps.refracted), [0.0; 3]);
        assert_eq!(total(&maps.direct), [0.0; 3]);
        let aimed: u64 = statistics.lights.iter().flat_map(|l| &l.ledgers).map(|l| l.aimed.flux).sum();
        assert_eq!(aimed, 0);
    }
}

#[test]
fn a_receiver_behind_the_light_gets_no_caustic() {
    // Light between floor and plate: the floor is lit straight, the plate's light goes up.
    let shape = LightShape::Point { position_m: DVec3::Y * 0.05, range_m: None };
    let scene = plate_over_floor(glass(1.5), 0.2, light(shape, 1.0));
    let (maps, statistics) = bake(&scene, 16, &few());
    assert_eq!(total(&maps.refracted), [0.0; 3]);
    let under = maps.direct[8 * 16 + 8];
    // Right under the light: 1 cd / (0.05 m)^2, over a texel that is wider than it is far.
    assert!(under[1] > 100.0 && under[1] < 400.0, "{under:?}");
    let ledgers = &statistics.lights[0].ledgers;
    assert!(ledgers.iter().all(|l| l.emitted.flux > 0 && l.landed.flux == 0));
}

#[test]
fn light_parallel_to_faces_is_no_trouble() {
    for direction in [DVec3::X, DVec3::NEG_Z, DVec3::new(1.0, 0.0, 1.0)] {
        let scene = plate_over_floor(glass(1.5), 0.4, sun(direction));
        let (maps, statistics) = bake(&scene, 16, &few());
        assert_eq!(total(&maps.direct), [0.0; 3], "{direction}");
        assert_eq!(total(&maps.refracted), [0.0; 3], "{direction}");
        assert!(statistics.photons > 0);
    }
}

#[test]
fn light_ends_at_its_range() {
    let lit = |range_m| {
        let shape = LightShape::Point { position_m: DVec3::Y * 0.8, range_m };
        let (maps, _) = bake(&plate_over_floor(glass(1.5), 0.2, light(shape, 1.0)), 16, &few());
        (total(&maps.direct)[1] > 0.0, total(&maps.refracted)[1] > 0.0)
    };
    assert_eq!(lit(None), (true, true));
    // As far as the plate, but not as far as the floor; then not even as far as the plate.
    assert_eq!(lit(Some(0.7)), (false, true));
    assert_eq!(lit(Some(0.4)), (false, false));
}

#[test]
fn lights_add_up() {
    let mut scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::new(0.2, -1.0, 0.1)));
    let lamp = LightShape::Point { position_m: DVec3::new(0.1, 1.0, 0.3), range_m: None };
    scene.lights.push(light(lamp, 0.5));
    let (both, statistics) = bake(&scene, 32, &few());
    assert_eq!(statistics.lights.len(), 2);
    let [(a, sa), (b, sb)] = [0, 1].map(|i| bake(&scene, 32, &Settings { lights: Some(vec![i]), ..few() }));
    assert_eq!(statistics.lights, [sa.lights, sb.lights].concat());
    for (sum, (a, b)) in both.refracted.iter().zip(a.refracted.iter().zip(&b.refracted)) {
        for c in 0..3 {
            assert!((sum[c] - (a[c] + b[c])).abs() <= 1e-6 * sum[c]);
        }
    }
    assert!(total(&a.refracted)[1] > 0.0 && total(&b.refracted)[1] > 0.0);
}

#[test]
fn a_light_among_its_receivers_sees_all_of_them() {
    // Inside a room: above the floor, below the ceiling, walls around. Six views instead of one.
    let mut scene = plate_over_floor(
        glass(1.0),
        0.2,
        light(LightShape::Point { position_m: DVec3::Y * 0.6, range_m: None }, 1.0),
    );
    scene.cameras.push(spectral_scene::Camera::look_at(DVec3::new(0.3, 0.45, 0.3), DVec3::ZERO));
    let ceiling = spectral_scene::Mesh { triangles: vec![[0, 2, 1], [0, 3, 2]], ..quad(1.0) };
    place(&mut scene, "ceiling", ceiling, opaque([1.0; 3]), DVec3::Y);
    let with_plate = picture(&scene, &few());
    scene.objects.remove(1);
    let without = picture(&scene, &few());
    // A plate without contrast over a floor of 1: nearly the same picture, caustic for direct light.
    let sum = |p: &asm_core::Picture| p.xyz.iter().map(|t| f64::from(t[1])).sum::<f64>();
    assert!(sum(&without) > 1.0);
    assert!((sum(&with_plate) / sum(&without) - 1.0).abs() < 0.01, "{} {}", sum(&with_plate), sum(&without));
}

#[test]
fn lights_too_close_and_too_far_are_refused_with_the_numbers() {
    let refused = |position_m| {
        let scene =
            plate_over_floor(glass(1.5), 0.4, light(LightShape::Point { position_m, range_m: None }, 1.0));
        asm_core::bake_plan(&scene, 0, [16; 2], &few(), &frame_plan::Limits::default()).unwrap_err()
    };
    assert!(matches!(refused(DVec3::Y * 0.2), PlanError::LightTooClose { opening_deg: 360.0, .. }));
    let close = refused(DVec3::Y * 0.26);
    assert!(
        matches!(close, PlanError::LightTooClose { opening_deg, .. } if opening_deg > 150.0 && opening_deg < 180.0),
        "{close}"
    );
    assert!(matches!(refused(DVec3::Y * 1e6), PlanError::LightTooFar { .. }));
}
