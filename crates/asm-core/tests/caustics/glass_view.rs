//! Deferred refraction: what a camera sees through glass, and both rules of refraction.

use asm_core::{GlassView, Interfaces, Method, Picture, RefractionRule, Settings, render_plan};
use frame_plan::Executor;
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_core::wavelengths::Scheme;
use spectral_scene::{Scene, bundled};

use crate::stage::*;

fn small(method: Method) -> Settings {
    Settings { emission_size: 128, map_size: Some(128), ..Settings::of(method) }
}

fn without_contrast(name: &str) -> Scene {
    let mut scene = bundled(name).unwrap();
    for material in scene.materials.iter_mut().filter(|m| m.transmission > 0.0) {
        material.dispersion = Dispersion::Constant { n: 1.0 };
        material.attenuation = None;
        material.base_color = [1.0; 3];
        material.transmission = 1.0;
    }
    scene
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let brightest = b.xyz.iter().flatten().copied().fold(0.0, f32::max);
    let pairs = a.xyz.iter().flatten().zip(b.xyz.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / brightest
}

#[test]
fn glass_without_contrast_shows_what_is_behind_it() {
    for name in ["sphere", "gem", "ring"] {
        let scene = without_contrast(name);
        let straight = Settings { glass_view: Some(GlassView::Straight), ..small(Method::CausticsMap) };
        let (wanted, none) = seen(&scene, [80, 60], &straight);
        assert_eq!(none.view, None);
        // All wavelengths together too, whatever their weights: Table 1 has RGB ones, which are negative in XYZ.
        for scheme in [Scheme::Optimal, Scheme::Uniform, Scheme::Asm2013] {
            let deferred = Some(GlassView::Deferred);
            let settings =
                Settings { scheme: Some(scheme), prune: false, glass_view: deferred, ..straight.clone() };
            let (picture, statistics) = seen(&scene, [80, 60], &settings);
            let off = largest_difference(&picture, &wanted);
            assert!(off < 1e-4, "{name}, {scheme}: {off}");
            assert!(statistics.view.unwrap().seen > 0);
        }
    }
}

#[test]
fn wavelengths_that_go_the_same_way_add_up_to_one() {
    let mut scene = bundled("prism").unwrap();
    for material in &mut scene.materials {
        material.dispersion = Dispersion::Constant { n: material.dispersion.n_d() };
    }
    let one = seen(&scene, [80, 60], &small(Method::Acm)).0;
    let all = |n| {
        let settings = Settings { prune: false, wavelengths: Some(n), ..small(Method::Acm) };
        seen(&scene, [80, 60], &settings).0
    };
    for n in [7, 21] {
        let off = largest_difference(&all(n), &one);
        assert!(off < 1e-5, "{n} wavelengths: {off}");
    }
}

#[test]
fn dispersion_colours_what_is_seen_through_glass() {
    let scene = bundled("gem").unwrap();
    let settings = small(Method::Asm);
    let mut cpu = cpu();
    let plan = render_plan(&scene, 0, [160, 120], &settings, &cpu.limits()).unwrap();
    let mut picture = |alike: bool| {
        let mut plan = plan.clone();
        if alike {
            // The same index at all wavelengths, before the camera only: the caustic behind the glass keeps its colours.
            let optics = plan.plan.resource("view optics").unwrap().0 as usize;
            let bytes = plan.plan.resources[optics].initial.as_mut().unwrap();
            let row = 16 * scene.materials.len();
            let middle = bytes[3 * row..4 * row].to_vec();
            bytes.chunks_exact_mut(row).for_each(|wavelength| wavelength.copy_from_slice(&middle));
        }
        cpu.prepare(&plan.plan).unwrap();
        cpu.execute().unwrap();
        let (picture, statistics) = plan.read(&mut cpu).unwrap();
        (picture, statistics.view)
    };
    let (alike, _) = picture(true);
    let (split, ways) = picture(false);
    let mean = alike.xyz.iter().map(|t| t[1]).sum::<f32>() / alike.xyz.len() as f32;
    let coloured = |(a, b): &(&[f32; 3], &[f32; 3])| {
        let [x, y, z] = std::array::from_fn(|c| (a[c] - b[c]) / [0.95047, 1.0, 1.08883][c] / mean);
        (x - y).abs() + (z - y).abs() > 0.05
    };
    let count = split.xyz.iter().zip(&alike.xyz).filter(coloured).count();
    assert!(count > 15, "{count} pixels change colour");
    // Seven ways each.
    let v = ways.unwrap();
    let ways = v.seen + v.hidden + v.outside_picture + v.nothing + v.total_reflection + v.no_exit;
    assert!(ways > 0 && ways % 7 == 0, "{v:?}");
}

#[test]
fn a_floor_under_water_is_darker_by_the_square_of_the_index() {
    // Straight down: Fresnel and n^2 are all there is.
    let mut scene = bundled("water").unwrap();
    for material in scene.materials.iter_mut().filter(|m| m.transmission > 0.0) {
        material.dispersion = Dispersion::Constant { n: 1.33 };
        material.attenuation = None;
        material.base_color = [1.0; 3];
        material.transmission = 1.0;
    }
    let surface = scene.objects[scene.refractors().next().unwrap()].mesh;
    let surface = &mut scene.meshes[surface];
    surface.normals.clear();
    let level = surface.positions.iter().map(|p| p[1]).sum::<f32>() / surface.positions.len() as f32;
    surface.positions.iter_mut().for_each(|p| p[1] = level);
    let eye = DVec3::Y * f64::from(level);
    let camera = &mut scene.cameras[0];
    camera.world_from_camera = glam::DMat4::from_cols(
        DVec3::X.extend(0.0),
        DVec3::NEG_Z.extend(0.0),
        DVec3::Y.extend(0.0),
        (eye + DVec3::Y).extend(1.0),
    );
    camera.yfov_rad = 0.05;
    let mean = |view| {
        let settings = Settings { glass_view: Some(view), ..small(Method::Acm) };
        let picture = seen(&scene, [32, 32], &settings).0;
        picture.xyz.iter().map(|t| f64::from(t[1])).sum::<f64>() / 1024.0
    };
    let ratio = mean(GlassView::Deferred) / mean(GlassView::Straight);
    // The straight view has Fresnel's loss too.
    assert!((ratio * 1.33 * 1.33 - 1.0).abs() < 0.005, "{ratio}");
}

#[test]
fn followed_reflections_leave_less_dark() {
    let scene = bundled("gem").unwrap();
    let dark = |view_bounces| {
        let settings = Settings { view_bounces, ..small(Method::Acm) };
        seen(&scene, [80, 60], &settings).1.view.unwrap().total_reflection
    };
    let (none, three) = (dark(0), dark(3));
    assert!(three < none / 2, "{none} without, {three} with three");
}

#[test]
fn a_picture_of_one_pixel_and_glass_without_backs_are_no_trouble() {
    for name in ["sphere", "water", "gem"] {
        let scene = bundled(name).unwrap();
        seen(&scene, [1, 1], &small(Method::Asm));
        seen(&scene, [3, 64], &Settings { picture_samples: 1, ..small(Method::Asm) });
    }
    // A single sheet of a closed material has no other side.
    let mut scene = bundled("sphere").unwrap();
    let glass = scene.refractors().next().unwrap();
    let mesh = scene.objects[glass].mesh;
    scene.meshes[mesh].triangles.truncate(40);
    seen(&scene, [40, 30], &small(Method::Asm));
}

#[test]
fn pictures_without_glass_or_light_have_no_such_pass() {
    let mut scene = bundled("sphere").unwrap();
    let limits = cpu().limits();
    let passes = |scene: &Scene| {
        let plan = render_plan(scene, 0, [16; 2], &small(Method::Asm), &limits).unwrap().plan;
        let kept = plan.decisions.iter().find(|d| d.pass == "deferred_refraction").unwrap().clone();
        (plan.step_names().iter().any(|s| s.starts_with("deferred_refraction")), kept)
    };
    let (there, decision) = passes(&scene);
    assert!(there && decision.kept && decision.reason.contains("deferred refraction: on"), "{decision:?}");
    scene.lights[0].intensity = 0.0;
    assert!(!passes(&scene).0);
    scene.lights[0].intensity = 1.0;
    let glass = scene.refractors().next().unwrap();
    scene.objects.remove(glass);
    let (there, decision) = passes(&scene);
    assert!(!there && !decision.kept && decision.reason.contains("deferred refraction: off"), "{decision:?}");
}

#[test]
fn samples_give_way_before_the_background_outgrows_a_binding() {
    let scene = bundled("sphere").unwrap();
    let limits = frame_plan::Limits { max_storage_binding_bytes: 8 << 20, ..frame_plan::Limits::default() };
    let settings = Settings { picture_samples: 4, ..small(Method::Asm) };
    let plan = render_plan(&scene, 0, [256, 256], &settings, &limits).unwrap().plan;
    let background = &plan.resources[plan.resource("background").unwrap().0 as usize];
    assert_eq!(background.kind.bytes(), 16 * 512 * 512);
    plan.validate(&asm_core::PASSES, &limits).unwrap();
}

#[test]
fn glsl_reflects_nothing_and_puts_total_reflection_down_where_it_is() {
    // Light from above meets the slanting back of a wedge beyond the critical angle.
    let mut scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let mesh = &mut scene.meshes[1];
    for p in &mut mesh.positions {
        // The bottom slants by 60 degrees.
        if p[1] < 0.0 {
            p[1] -= 1.7 * (p[0] + 0.2);
        }
    }
    let ledger = |refraction| {
        let settings = Settings { refraction_rule: refraction, ..aligned(64) };
        bake(&scene, 32, &settings).1.lights[0].ledgers[0]
    };
    let (fresnel, glsl) = (ledger(RefractionRule::Fresnel), ledger(RefractionRule::Glsl));
    assert!(fresnel.total_reflection.photons > 0 && fresnel.reflected.flux > 0, "{fresnel:?}");
    assert_eq!((glsl.total_reflection.photons, glsl.reflected.flux, glsl.kept_inside.flux), (0, 0, 0));
    assert!(glsl.astray.photons >= fresnel.total_reflection.photons, "{glsl:?}");
    // Where nothing reflects totally, the two differ by what Fresnel takes.
    let plate = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let landed = |refraction, interfaces| {
        let settings = Settings { refraction_rule: refraction, interfaces, ..aligned(64) };
        let ledger = bake(&plate, 32, &settings).1.lights[0].ledgers[0];
        ledger.landed.flux as f64 / ledger.emitted.flux as f64
    };
    assert!((landed(RefractionRule::Glsl, Interfaces::Two) - 1.0).abs() < 1e-9);
    assert!((landed(RefractionRule::Fresnel, Interfaces::Two) - 0.96 * 0.96).abs() < 1e-4);
}
