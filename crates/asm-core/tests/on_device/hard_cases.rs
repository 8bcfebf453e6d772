//! Cases that break assumptions, on a device, against what physics says of them. Executors include this beside their `device`,
//! which makes them.

use asm_core::shared::view::View;
use asm_core::{
    Ledger, MapFit, Method, PlanError, Reflections, Settings, Splat, Statistics, bake_plan, render_plan,
};
use frame_plan::Executor;
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{Camera, IrradianceMaps, LightShape, Scene};

use crate::device;
use crate::stage::*;

pub(crate) fn bake_on(
    gpu: &mut dyn Executor,
    scene: &Scene,
    size: u32,
    settings: &Settings,
) -> (IrradianceMaps, Statistics) {
    let receiver = scene.receiver("receiver").unwrap();
    let plan = bake_plan(scene, receiver, [size; 2], settings, &gpu.limits()).unwrap();
    gpu.prepare(&plan.plan).unwrap();
    gpu.execute().unwrap();
    let (maps, statistics) = plan.read(gpu).unwrap();
    assert!(statistics.lights.iter().flat_map(|l| &l.ledgers).all(Ledger::balances));
    assert!(
        [&maps.direct, &maps.refracted].into_iter().flatten().flatten().all(|v| v.is_finite() && *v >= 0.0)
    );
    (maps, statistics)
}

/// Views lay the plate's edges a hundredth of a texel beyond the centres of their outermost texels. Rasterisers that round to
/// coarser steps than twice that may lay them onto the centres, where a row and a column of photons are no longer the plate's:
/// of the `photons` along a side of a texel of the bake at the floor's rim, one.
fn rim_loss(gpu: &dyn Executor, photons: f64) -> f64 {
    let bits = gpu.info().subpixel_bits.unwrap_or(4);
    let rounding = 0.5_f64.powi(bits as i32 + 1);
    if rounding < 0.01 { 0.0 } else { 1.0 - (1.0 - 1.0 / photons).powi(2) }
}

/// Every texel of a floor of `size` x `size` texels has the share `wanted` of the light, those at its rim less by up to `rim_loss`.
fn assert_even(shares: impl Iterator<Item = f64>, size: u32, wanted: f64, rim_loss: f64) {
    for (i, got) in (0..).zip(shares) {
        let [x, y] = [i % size, i / size];
        let is_rim = [x, y].iter().any(|&at| at == 0 || at == size - 1);
        let least = if is_rim { wanted * (1.0 - rim_loss) } else { wanted };
        assert!((least - 2e-6..wanted + 2e-6).contains(&got), "{x}, {y}: {got}, wanted {wanted}");
    }
}

#[test]
fn plates_across_the_light_pass_what_fresnel_leaves() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    // The index of vacuum is the direct light; just above it nothing measurable is lost; 1.5 and 2.4 lose 4 % and 17 % twice.
    for n in [1.0, 1.0 + 1e-6, 1.0001, 1.5, 2.4] {
        let scene = plate_over_floor(glass(n), 1.0, sun(DVec3::NEG_Y));
        let (maps, _) = bake_on(&mut gpu, &scene, 32, &aligned(128));
        let wanted = (1.0 - ((n - 1.0) / (n + 1.0)).powi(2)).powi(2);
        for c in 0..3 {
            let shares = maps.refracted.iter().map(|texel| f64::from(texel[c]) / D65[c]);
            assert_even(shares, 32, wanted, rim_loss(&gpu, 4.0));
        }
        assert_eq!(total(&maps.direct), [0.0; 3]);
    }
}

#[test]
fn strong_and_no_dispersion_follow_fresnel_at_every_wavelength() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    for khr_dispersion in [2.0, 0.0] {
        let dispersion = Dispersion::from_khr(1.6, khr_dispersion).unwrap();
        let mut material = glass(1.0);
        material.dispersion = dispersion.clone();
        let mut scene = plate_over_floor(material, 1.0, sun(DVec3::NEG_Y));
        for nm in [400.0, 700.0] {
            scene.lights[0].spectrum = spectral_core::light::LightSpectrum::line(nm).unwrap();
            let (maps, _) = bake_on(&mut gpu, &scene, 16, &aligned(64));
            let n = dispersion.ior(nm);
            let wanted = (1.0 - ((n - 1.0) / (n + 1.0)).powi(2)).powi(2);
            let shares = maps.refracted.iter().map(|texel| f64::from(texel[1]));
            assert_even(shares, 16, wanted, rim_loss(&gpu, 4.0));
        }
    }
}

#[test]
fn one_texel_holds_every_photon() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let scene = plate_over_floor(glass(1.5), 0.5, sun(DVec3::NEG_Y));
    for splat in [Splat::Point, Splat::Gaussian { radius: 8 }, Splat::Auto] {
        let settings = Settings {
            emission_size: 64,
            map_size: Some(1),
            wavelengths: Some(1),
            splat,
            prune: false,
            reflections: Reflections::None,
            ..Settings::of(Method::CausticsMap)
        };
        let mut plan = bake_plan(&scene, 0, [16; 2], &settings, &gpu.limits()).unwrap();
        let map = plan.plan.resource("map").unwrap();
        plan.plan.resources[map.0 as usize].readable = true;
        gpu.prepare(&plan.plan).unwrap();
        gpu.execute().unwrap();
        let words = device::words(&gpu.read(map).unwrap());
        let light = plan.read(&mut gpu).unwrap().1.lights.remove(0);
        let ledger = light.ledgers[0];
        assert!(ledger.balances() && ledger.landed.photons > 1000, "{ledger:?}");
        // Z is the largest of D65, its weight a whole: to the last unit what landed, carried over into the high word.
        let z = u64::from(words[4]) | u64::from(words[5]) << 32;
        assert_eq!(z, ledger.landed.flux + ledger.beside.flux, "{splat:?}");
        assert!(words[5] > 100, "the low word was full many times: {words:?}");
    }
}

#[test]
fn light_that_meets_nothing_leaves_nothing() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let few = Settings { emission_size: 64, ..Settings::of(Method::CausticsMap) };
    let away = LightShape::Spot {
        position_m: DVec3::Y * 0.8,
        direction: DVec3::Y,
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.4,
        range_m: None,
    };
    for prune in [true, false] {
        let settings = Settings { prune, ..few.clone() };
        // A spot that shines away, and light along the floor and the plate's sides.
        for light in [light(away, 1.0), sun(DVec3::X), sun(DVec3::new(1.0, 0.0, 1.0))] {
            let scene = plate_over_floor(glass(1.5), 0.4, light);
            let (maps, statistics) = bake_on(&mut gpu, &scene, 16, &settings);
            assert_eq!((total(&maps.direct), total(&maps.refracted)), ([0.0; 3], [0.0; 3]));
            assert!(statistics.lights.iter().flat_map(|l| &l.ledgers).all(|l| l.landed.flux == 0));
        }
        // No glass: the floor in full light. No light and no object: black.
        let mut scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
        scene.objects.pop();
        let (maps, statistics) = bake_on(&mut gpu, &scene, 16, &settings);
        assert!(maps.direct.iter().all(|t| (t[1] - 1.0).abs() < 1e-6));
        assert_eq!(statistics.photons, 0);
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO);
        let empty = Scene { cameras: vec![camera], lights: scene.lights, ..Scene::default() };
        let plan = render_plan(&empty, 0, [1, 1], &settings, &gpu.limits()).unwrap();
        gpu.prepare(&plan.plan).unwrap();
        gpu.execute().unwrap();
        assert_eq!(plan.read(&mut gpu).unwrap().0.xyz, [[0.0; 3]]);
    }
}

#[test]
fn single_texels_and_pixels_are_means() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let settings = Settings { emission_size: 128, ..Settings::of(Method::CausticsMap) };
    let scene = plate_over_floor(glass(1.0), 2.0, sun(DVec3::NEG_Y));
    let (maps, _) = bake_on(&mut gpu, &scene, 1, &settings);
    assert!((maps.refracted[0][1] - 1.0).abs() < 5e-3, "{:?}", maps.refracted);
    // A pixel that sees only the floor, of reflectance 1: radiance is lux over pi.
    let mut scene = plate_over_floor(glass(1.0), 0.2, sun(DVec3::NEG_Y));
    scene.objects.pop();
    scene.cameras.push(Camera { yfov_rad: 0.1, ..Camera::look_at(DVec3::new(0.1, 1.0, 0.1), DVec3::ZERO) });
    let plan = render_plan(&scene, 0, [1, 1], &settings, &gpu.limits()).unwrap();
    gpu.prepare(&plan.plan).unwrap();
    gpu.execute().unwrap();
    let pixel = plan.read(&mut gpu).unwrap().0.xyz[0];
    assert!((f64::from(pixel[1]) * std::f64::consts::PI - 1.0).abs() < 1e-5, "{pixel:?}");
}

#[test]
fn maps_are_fitted_to_where_light_lands() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let mut scene = plate_over_floor(glass(1.5), 0.06, sun(DVec3::new(0.3, -1.0, 0.1)));
    scene.cameras.push(Camera::look_at(DVec3::ONE, DVec3::ZERO));
    let frame = |executor: &mut dyn Executor, fit| {
        let settings = Settings {
            map_fit: Some(fit),
            emission_size: 256,
            map_size: Some(256),
            ..Settings::of(Method::CausticsMap)
        };
        let mut plan = render_plan(&scene, 0, [64; 2], &settings, &executor.limits()).unwrap();
        let read = ["map", "views"].map(|name| plan.plan.resource(name).unwrap());
        for id in read {
            plan.plan.resources[id.0 as usize].readable = true;
        }
        executor.prepare(&plan.plan).unwrap();
        executor.execute().unwrap();
        let [map, views] = read.map(|id| executor.read(id).unwrap());
        let y = |texel: &[u8]| u64::from_le_bytes(texel[8..16].try_into().unwrap());
        let sum: u128 = map.chunks_exact(24).map(|texel| u128::from(y(texel))).sum();
        let views: Vec<View> =
            views.chunks_exact(size_of::<View>()).map(bytemuck::pod_read_unaligned).collect();
        let (picture, statistics) = plan.read(executor).unwrap();
        (sum, views, picture, statistics.lights)
    };
    let (wide, _, _, wide_books) = frame(&mut gpu, MapFit::Receivers);
    let (fitted, views, picture, books) = frame(&mut gpu, MapFit::Landings);
    assert_eq!((fitted, &books), (wide, &wide_books), "the same light to the unit");
    let zoom = views[1].texel_slope / views[2].texel_slope;
    assert!(zoom.min_element() >= 4.0, "{zoom}");
    // The CPU finds the same cells, and the same picture but at silhouettes.
    let (_, views_of_cpu, of_cpu, _) = frame(&mut cpu(), MapFit::Landings);
    for (a, b) in [
        (views[2].slope_center, views_of_cpu[2].slope_center),
        (views[2].slope_half, views_of_cpu[2].slope_half),
    ] {
        assert!(a.distance(b) < 1e-6, "{a} {b}");
    }
    let off = relative_rms(&picture.xyz, &of_cpu.xyz, 64);
    assert!(off < 1e-3, "{off}");
}

#[test]
fn maps_beyond_the_devices_limits_are_refused_with_the_numbers() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let limits = gpu.limits();
    let before = gpu.made();
    let scene = plate_over_floor(glass(1.5), 0.5, sun(DVec3::NEG_Y));
    // One texel more along each side than one binding of 24 bytes a texel holds; whole maps have at most 16384.
    let allowed = limits.max_storage_binding_bytes.min(limits.max_buffer_bytes);
    let side = ((allowed / 24).isqrt() + 1).min(16_384) as u32;
    let settings = Settings { map_size: Some(side), ..Settings::of(Method::CausticsMap) };
    let refused = bake_plan(&scene, 0, [64; 2], &settings, &limits).unwrap_err();
    assert!(
        matches!(&refused, PlanError::Limit { remedy: "map_size", .. }),
        "{side} texels along a side: {refused}"
    );
    let text = refused.to_string();
    assert!(text.contains("the device takes") && text.contains("lower map_size"), "{text}");
    let largest = limits.max_texture_size;
    let wide =
        bake_plan(&scene, 0, [largest + 1, 1], &Settings::of(Method::CausticsMap), &limits).unwrap_err();
    assert!(
        matches!(&wide, PlanError::Limit { needed, max, .. } if (*needed, *max) == (u64::from(largest) + 1, largest.into())),
        "{wide}"
    );
    assert_eq!(gpu.made(), before, "nothing was made");
    // And the device goes on.
    let small = Settings { emission_size: 64, ..Settings::of(Method::CausticsMap) };
    assert!(total(&bake_on(&mut gpu, &scene, 8, &small).0.refracted)[1] > 0.0);
}

/// 1.5 GiB of sums, on devices whose limits allow that; the numbers in an error, on all others.
#[test]
fn a_map_of_8192_texels_along_a_side_holds_its_light_or_is_refused() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let limits = gpu.limits();
    let scene = plate_over_floor(glass(1.5), 1.0, sun(DVec3::NEG_Y));
    // Photons are spread over 17 x 17 texels, of which every second along a side is looked up: 32 x 128 samples for 8192.
    let splat = Splat::Gaussian { radius: 8 };
    let settings = |side| Settings { wavelengths: Some(1), map_size: Some(side), splat, ..aligned(256) };
    let needed = 24 * 8192_u64.pow(2);
    let binding = limits.max_storage_binding_bytes.min(limits.max_buffer_bytes);
    match bake_plan(&scene, 0, [32; 2], &settings(8192), &limits) {
        Ok(plan) => {
            let bytes: u64 = plan.plan.resources.iter().map(|r| r.kind.bytes()).sum();
            assert!(needed <= binding && bytes <= limits.max_total_bytes, "{bytes} bytes in {limits:?}");
            gpu.prepare(&plan.plan).unwrap();
            gpu.execute().unwrap();
            let (maps, statistics) = plan.read(&mut gpu).unwrap();
            let ledger = &statistics.lights[0].ledgers[0];
            assert!(ledger.balances() && ledger.landed.photons > 250 * 250, "{ledger:?}");
            let mean = total(&maps.refracted)[1] / 32_f64.powi(2);
            assert!((mean - 0.96 * 0.96).abs() < 1e-3, "{mean}");
        }
        Err(PlanError::Limit { what, needed: got, max, remedy, .. }) if needed > binding => {
            assert_eq!((what.as_str(), got, max, remedy), ("buffer map", needed, binding, "map_size"));
        }
        Err(PlanError::Limit { needed: got, max, remedy, .. }) => {
            assert_eq!((max, remedy), (limits.max_total_bytes, "map_size"));
            assert!(got > max, "{got} bytes in {max}");
        }
        Err(other) => panic!("{other}"),
    }
}

/// A wedge of glass whose back face leans by `lean_deg`, under light straight down through its level front.
fn wedge_over_floor(lean_deg: f64, n: f64) -> Scene {
    let mut scene = plate_over_floor(glass(n), 1.0, sun(DVec3::NEG_Y));
    // The corners below x = 0.05 go down: the box becomes a prism of three sides.
    let drop = 0.1 * lean_deg.to_radians().tan() as f32;
    let mesh = &mut scene.meshes[1];
    *mesh = cuboid([0.1, 0.1, 0.1]);
    for position in &mut mesh.positions {
        if position[1] < 0.0 {
            position[1] = 0.05 - if position[0] < 0.0 { drop } else { 0.0 };
        }
    }
    scene
}

/// Share of unpolarised light that is reflected at this angle of incidence inside glass, Fresnel's equations.
fn reflectance_inside(incidence_deg: f64, n: f64) -> f64 {
    let (sin_i, cos_i) = incidence_deg.to_radians().sin_cos();
    let cos_t = (1.0 - (n * sin_i).powi(2)).sqrt();
    let [s, p] = [(n * cos_i - cos_t) / (n * cos_i + cos_t), (cos_i - n * cos_t) / (cos_i + n * cos_t)];
    0.5 * (s * s + p * p)
}

#[test]
fn light_beyond_the_critical_angle_at_the_back_is_reflected_totally() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let settings = Settings { wavelengths: Some(1), ..aligned(128) };
    // The critical angle of 1.5 is 41.81 degrees.
    for lean_deg in [20.0, 35.0, 41.7, 41.9, 45.0, 60.0] {
        let (maps, statistics) = bake_on(&mut gpu, &wedge_over_floor(lean_deg, 1.5), 16, &settings);
        let ledger = &statistics.lights[0].ledgers[0];
        // At the wedge's thin end a row of photons or two finds no texel of the back.
        assert!(ledger.no_exit.photons <= ledger.emitted.photons / 50, "{lean_deg}: {ledger:?}");
        let at_the_back = ledger.emitted.flux - ledger.reflected.flux - ledger.no_exit.flux;
        if lean_deg < 41.81 {
            assert_eq!(ledger.total_reflection.flux, 0, "{lean_deg}: {ledger:?}");
            let kept = ledger.kept_inside.flux as f64 / at_the_back as f64;
            let wanted = reflectance_inside(lean_deg, 1.5);
            assert!((kept - wanted).abs() < 1e-4, "{lean_deg}: {kept}, Fresnel says {wanted}");
            assert!(total(&maps.refracted)[1] > 0.0, "{lean_deg}: {ledger:?}");
        } else {
            assert_eq!(ledger.total_reflection.flux, at_the_back, "{lean_deg}: {ledger:?}");
            assert_eq!(total(&maps.refracted), [0.0; 3], "{lean_deg}");
        }
    }
}

#[test]
fn light_bent_out_of_the_view_is_counted() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    let settings = Settings { wavelengths: Some(1), ..aligned(128) };
    // Bent by 34.6 degrees, light goes 0.14 sideways on its way to the floor; the small one ends before that.
    for (side, lands) in [(1.0, true), (0.1, false)] {
        let mut scene = wedge_over_floor(40.0, 1.5);
        scene.meshes[0] = quad(side);
        let (maps, statistics) = bake_on(&mut gpu, &scene, 16, &settings);
        let ledger = &statistics.lights[0].ledgers[0];
        let ended = ledger.reflected.flux + ledger.kept_inside.flux + ledger.no_exit.flux;
        let left = ledger.emitted.flux - ended;
        println!("{side}: {ledger:?} {:?}", total(&maps.refracted));
        let away = ledger.outside_map.flux + ledger.escaped.flux;
        assert!(left > ledger.emitted.flux / 2, "{ledger:?}");
        assert_eq!(
            if lands { (left, 0) } else { (0, left) },
            (ledger.landed.flux, away),
            "{side}: {ledger:?}"
        );
        assert_eq!(lands, total(&maps.refracted)[1] > 0.0, "{side}");
    }
}

#[test]
fn a_missing_back_face_lets_light_land() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    // The bottom is missing: what enters by the top finds no back face, but the mesh has an edge.
    let mut scene = plate_over_floor(glass(1.5), 1.0, sun(DVec3::NEG_Y));
    scene.meshes[1].triangles.drain(4..6);
    let (maps, _) = bake_on(&mut gpu, &scene, 16, &aligned(64));
    let middle = maps.refracted[8 * 16 + 8];
    assert!((middle[1] - 0.96).abs() < 1e-4, "{middle:?}");
    // A whole mesh: both faces take their share.
    let whole = plate_over_floor(glass(1.5), 1.0, sun(DVec3::NEG_Y));
    let middle = bake_on(&mut gpu, &whole, 16, &aligned(64)).0.refracted[8 * 16 + 8];
    assert!((middle[1] - 0.96 * 0.96).abs() < 1e-4, "{middle:?}");
}

#[test]
fn refractors_over_each_other_take_the_first_ones_light() {
    let Some(mut gpu) = device::executor(asm_core::PASSES) else { return };
    // Photons know the first refractor of their texel: what stands behind it in the light's view neither bends nor takes
    // anything, and no flux is lost or counted twice. Apart, touching, and partly in each other.
    let first = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let settings = Settings { wavelengths: Some(1), ..Settings::of(Method::CausticsMap) };
    let (one, of_one) = bake_on(&mut gpu, &first, 32, &settings);
    let a = &of_one.lights[0].ledgers[0];
    for (height, y) in [(0.02, 0.08), (0.1, 0.1), (0.1, 0.17)] {
        let mut both = first.clone();
        place(&mut both, "behind", cuboid([0.4, height, 0.4]), glass(2.0), DVec3::Y * y);
        let (two, of_two) = bake_on(&mut gpu, &both, 32, &settings);
        let b = &of_two.lights[0].ledgers[0];
        assert_eq!(a.emitted.photons, b.emitted.photons, "{y}");
        assert!(b.landed.flux > 0, "{y}: {b:?}");
        assert!((total(&two.refracted)[1] / total(&one.refracted)[1] - 1.0).abs() < 1e-3, "{y}");
    }
    // One wholly in the other: the back that the light sees is the inner one's, the light in the outer one has no exit. It is
    // counted.
    let mut nested = first;
    place(&mut nested, "inside", cuboid([0.4, 0.02, 0.4]), glass(2.0), DVec3::Y * 0.2);
    let (two, of_two) = bake_on(&mut gpu, &nested, 32, &settings);
    let b = &of_two.lights[0].ledgers[0];
    assert_eq!((b.no_exit.flux, b.landed.flux), (b.emitted.flux - b.reflected.flux, 0), "{b:?}");
    assert_eq!(total(&two.refracted), [0.0; 3]);
}
