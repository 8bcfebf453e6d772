//! Relit surfaces as one plan on every executor: the same bits twice and on one driver, the same light on two.

use asm_core::Picture;
use frame_plan::Executor;
use glam::{DMat3, DVec3};
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::light_xyz;
use spectral_prt::{
    Albedo, Bands, BounceSettings, Exposure, GlossTransfer, IndexMap, Palette, PhongLobe, Projection,
    Relighting, SceneTransfer, Shot, SpectralMap, Surface, Transfer, TransferSettings, add_bounces,
    precompute,
};
use workspace_tests::prt_executors;

#[allow(dead_code, reason = "some of it is for the CPU executor alone")]
#[path = "../../crates/spectral-prt/tests/relighting/stage.rs"]
mod stage;

use stage::*;

/// How far the CPU and a device may be from each other where they see the same triangle and texel: rounding of some hundred
/// products, as a share of the brightest Y.
const PARITY: f64 = 1e-5;
/// Share of pixels at edges of triangles and between the texels of index maps, where rounding decides what is seen.
const AT_EDGES: f64 = 5e-3;

fn run(name: &str, relighting: &Relighting, executor: &mut dyn Executor) -> Picture {
    executor.execute().unwrap_or_else(|error| panic!("{name}: {error}"));
    relighting.read(executor).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Share of pixels that differ by more than [`PARITY`].
fn differing(a: &Picture, b: &Picture) -> f64 {
    let brightest = f64::from(a.xyz.iter().map(|xyz| xyz[1]).fold(0.0, f32::max));
    let far = |(a, b): &(&[f32; 3], &[f32; 3])| {
        // A NaN is far from everything.
        !(0..3).all(|c| f64::from((a[c] - b[c]).abs()) <= PARITY * brightest)
    };
    a.xyz.iter().zip(&b.xyz).filter(far).count() as f64 / a.xyz.len() as f64
}

/// What every executor makes of a stage: twice the same bits on each, the same bits on one driver, near each other on two.
fn on_all(name: &str, stage: &Stage<'_>, shot: &Shot<'_>) -> Vec<(&'static str, Picture)> {
    let relighting = stage.plan(shot).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut pictures: Vec<(&'static str, String, Picture)> = Vec::new();
    for (id, mut executor) in prt_executors() {
        let executor = executor.as_mut();
        executor.prepare(&relighting.plan).unwrap_or_else(|error| panic!("{name} on {id}: {error}"));
        let first = run(name, &relighting, executor);
        assert!(first == run(name, &relighting, executor), "{name}: {id} gave two pictures");
        for (other, device, picture) in &pictures {
            let share = differing(picture, &first);
            assert!(share <= AT_EDGES, "{name}: {id} and {other} differ in {share} of all pixels");
            if *device == executor.info().to_string() {
                assert!(*picture == first, "{name}: {id} and {other}, on one driver");
            }
        }
        pictures.push((id, executor.info().to_string(), first));
    }
    pictures.into_iter().map(|(id, _, picture)| (id, picture)).collect()
}

/// A ball in front of a wall with texture coordinates.
fn ball_and_wall() -> ([Surface; 2], Vec<[f32; 2]>) {
    let (square, uvs) = square();
    let corners: Vec<DVec3> = square.positions().iter().map(|p| *p * 3.0 - DVec3::Z * 1.5).collect();
    let wall = Surface::new(&corners, square.normals(), square.triangles()).expect("a wall");
    ([ball(DMat3::IDENTITY, true), wall], uvs)
}

/// Every kind of albedo in one picture, under a turned sky; a spoiled basis, light or rotation is no rounding.
#[test]
fn every_executor_relights_alike_and_notices_what_is_spoiled() {
    let (surfaces, uvs) = ball_and_wall();
    let transfer = transfer(&surfaces, 64);
    let chart = color_checker::sampled(&GRID);
    let (five, eight) = (basis(5), basis(8));
    let seen_by = camera(DVec3::new(1.0, 1.5, 4.0));
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 1.0, 0.2).normalize(), 0.7);
    let fl2 = light(Illuminant::Fl2);
    for (name, projection) in [
        ("5 coefficients", Projection::Spectral(&five)),
        ("8 coefficients", Projection::Spectral(&eight)),
        ("RGB", RGB),
    ] {
        let mut stage = with_chart(&surfaces, &transfer, &projection, &chart, &uvs);
        let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&fl2));
        let shot = Shot { rotation: turn, ..shot(&sky, &seen_by) };
        let palette_alone = on_all(name, &stage, &shot);
        let texels = (0..24).rev().collect();
        let map = SpectralMap::new(&projection, [4, 6], texels, &chart).expect("24 texels");
        stage.spectral_maps = vec![map];
        assert_eq!(palette_alone, on_all(name, &stage, &shot), "{name}: a map that no surface has");
        stage.albedos[0] = Albedo::Mapped { map: 0, uvs: vec![[0.3, 0.8]; surfaces[0].positions().len()] };
        let with_map = on_all(name, &stage, &shot);
        assert!(differing(&palette_alone[0].1, &with_map[0].1) > AT_EDGES, "{name}");

        let (_, truth) = &with_map[0];
        let mut spoiled = projection.light(&fl2);
        spoiled[1] *= 1.001;
        let other_light = from_direction(DVec3::new(1.0, 2.0, 1.5), &spoiled);
        let slightly = DMat3::from_rotation_y(0.002) * turn;
        for (what, other) in [
            ("another coefficient of the light", Shot { sky: &other_light, ..shot }),
            ("another rotation", Shot { rotation: slightly, ..shot }),
        ] {
            let share = differing(truth, &stage.picture(&other));
            assert!(share > AT_EDGES, "{name}: {what} went unnoticed, {share}");
        }
        stage.palette = Palette::new(&projection, &five_nm_off(&chart));
        stage.albedos[0] = Albedo::Entry(14);
        let share = differing(&palette_alone[0].1, &stage.picture(&shot));
        assert!(share > AT_EDGES, "{name}: reflectances 5 nm off went unnoticed, {share}");
    }
}

fn five_nm_off(chart: &[Vec<f64>]) -> Vec<Vec<f64>> {
    chart.iter().map(|r| [&r[1..], &r[r.len() - 1..]].concat()).collect()
}

fn with_chart<'a>(
    surfaces: &'a [Surface],
    transfer: &'a Transfer,
    projection: &Projection<'_>,
    chart: &[Vec<f64>],
    uvs: &[[f32; 2]],
) -> Stage<'a> {
    let mut stage = Stage::new(surfaces, transfer, projection, chart);
    stage.settings.size = [96, 64];
    stage.index_maps = vec![IndexMap::new([6, 4], (0..24).collect()).expect("24 texels")];
    stage.albedos = vec![Albedo::Entry(14), Albedo::Indexed { map: 0, uvs: uvs.to_vec() }];
    stage
}

/// White furnace, on every executor and by every path: nothing but the illuminant's colour.
#[test]
fn every_executor_shows_the_illuminant_on_an_open_white_ball() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let transfer = transfer(&surfaces, 1);
    let white = [GRID.sample(|_| 1.0)];
    let seen_by = camera(DVec3::new(1.0, 2.0, 4.0));
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let fl11 = light(Illuminant::Fl11);
    let sky = even(&projection.light(&fl11));
    let truth = light_xyz(&GRID, OBSERVER, &fl11);
    let uvs: Vec<[f32; 2]> = surfaces[0].positions().iter().map(|p| [p.x as f32, p.y as f32]).collect();
    let mut stage = Stage::new(&surfaces, &transfer, &projection, &white);
    stage.spectral_maps =
        vec![SpectralMap::new(&projection, [3, 5], vec![0; 15], &white).expect("15 texels")];
    for albedo in [Albedo::Entry(0), Albedo::Mapped { map: 0, uvs }] {
        stage.albedos = vec![albedo];
        for (id, picture) in on_all("furnace", &stage, &shot(&sky, &seen_by)) {
            let errors =
                seen(&picture).flat_map(|xyz| (0..3).map(move |c| (xyz[c] - truth[c]).abs() / truth[1]));
            let worst = errors.fold(0.0, f64::max);
            println!("white furnace on {id}: {worst:.1e}");
            assert!(seen(&picture).count() > 150 && worst < 1e-5, "{id}: {worst}");
        }
    }
}

/// A ball that shines in front of a wall that does not; another lobe is no rounding.
#[test]
fn every_executor_shows_lobes_alike() {
    let (surfaces, _) = ball_and_wall();
    let settings = TransferSettings { bands: Bands::new(9).expect("up to ten"), rays: 64 };
    let wide = precompute(&surfaces, &settings, &mut |_| {}).expect("good settings");
    let direct = wide.with_bands(Bands::default());
    let lobe = |exponent| Some(PhongLobe::new(exponent).expect("a lobe"));
    let gloss = |exponent| {
        GlossTransfer::new(&wide, Bands::default(), &[lobe(exponent), None]).expect("enough bands")
    };
    let (ten, nine) = (gloss(10.0), gloss(9.99));
    let chart = color_checker::sampled(&GRID);
    let seen_by = camera(DVec3::new(1.0, 1.5, 4.0));
    let (five, eight) = (basis(5), basis(8));
    for (name, projection) in [
        ("5 coefficients", Projection::Spectral(&five)),
        ("8 coefficients", Projection::Spectral(&eight)),
        ("RGB", RGB),
    ] {
        let mut stage = Stage::new(&surfaces, &direct, &projection, &chart[13..15]);
        stage.settings.size = [96, 64];
        stage.gloss = Some(&ten);
        stage.palette = stage.palette.with_gloss(&projection, &[GRID.sample(|_| 0.3), GRID.sample(|_| 0.0)]);
        let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::Fl2)));
        let truth = on_all(name, &stage, &shot(&sky, &seen_by)).swap_remove(0).1;
        stage.gloss = Some(&nine);
        let share = differing(&truth, &stage.picture(&shot(&sky, &seen_by)));
        assert!(share > AT_EDGES, "{name}: an exponent of 9.99 for 10 went unnoticed, {share}");
    }
}

/// Spectral transfer has more terms than any light; a frame without it is another one.
#[test]
fn every_executor_shows_surfaces_that_light_each_other() {
    let corners = |to: fn(DVec3) -> DVec3| square().0.positions().iter().map(|p| to(*p)).collect::<Vec<_>>();
    let quad = |corners: Vec<DVec3>, normal, triangles: &[[u32; 3]]| {
        Surface::new(&corners, &[normal; 4], triangles).expect("a quad")
    };
    let surfaces = [
        quad(corners(|p| p), DVec3::Z, square().0.triangles()),
        quad(corners(|p| DVec3::new(p.x, -1.0, p.y + 1.0)), DVec3::Y, &[[0, 1, 3], [1, 2, 3]]),
    ];
    let direct = transfer(&surfaces, 64);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[14].clone(), chart[18].clone()];
    let settings = BounceSettings { rays: 64, bounces: 2 };
    let bounced =
        add_bounces(&surfaces, &direct, GRID, &paints, &settings, &mut |_| {}).expect("good settings");
    let basis = basis(6);
    let seen_by = camera(DVec3::new(1.0, 1.5, 4.0));
    let d50 = light(Illuminant::D50);
    let mut pictures = Vec::new();
    for (projection, transfer) in [
        (Projection::Bounced(&basis, &bounced), SceneTransfer::Bounced(&bounced)),
        (Projection::Spectral(&basis), SceneTransfer::Direct(&direct)),
    ] {
        let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&d50));
        let stage = Stage { transfer, ..Stage::new(&surfaces, &direct, &projection, &paints) };
        pictures.push(on_all("interreflection", &stage, &shot(&sky, &seen_by)).swap_remove(0).1);
    }
    assert!(differing(&pictures[0], &pictures[1]) > 0.1);
}

/// A frame that has come by writing numbers is the first frame of its own plan, and nothing was made for it.
#[test]
fn frames_change_by_numbers_alone_on_every_executor() {
    let (surfaces, uvs) = ball_and_wall();
    let transfer = transfer(&surfaces, 16);
    let chart = color_checker::sampled(&GRID);
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let stage = with_chart(&surfaces, &transfer, &projection, &chart, &uvs);
    let lamps = [Illuminant::D65, Illuminant::A, Illuminant::Fl4];
    let moment = |i: u32| {
        let sky = from_direction(DVec3::ONE, &projection.light(&light(lamps[i as usize % 3])));
        let seen_by = camera(DVec3::new(0.3 * f64::from(i), 1.0, 4.0));
        (sky, seen_by, DMat3::from_rotation_y(0.2 * f64::from(i)), 1.0 + 0.1 * f64::from(i))
    };
    let shot_of = |i: u32, with: &mut dyn FnMut(&Shot<'_>)| {
        let (sky, seen_by, rotation, factor) = moment(i);
        let exposure = Exposure { factor, balance: None };
        with(&Shot { rotation, exposure, ..shot(&sky, &seen_by) });
    };
    let plan_of = |i: u32| {
        let mut plan = None;
        shot_of(i, &mut |shot| plan = Some(stage.plan(shot).expect("a plan")));
        plan.expect("a plan was made")
    };
    for (id, mut executor) in prt_executors() {
        let executor = executor.as_mut();
        let relighting = plan_of(0);
        executor.prepare(&relighting.plan).expect("a valid plan");
        let mut by_second = None;
        for i in 0..6 {
            shot_of(i, &mut |shot| relighting.write(executor, shot).expect("a good shot"));
            executor.execute().expect("a frame");
            if i == 1 {
                by_second = Some(executor.made());
            }
        }
        assert_eq!(Some(executor.made()), by_second, "{id}");
        let last = relighting.read(executor).expect("a picture");
        for (i, is_last) in [(5, true), (4, false)] {
            let own = plan_of(i);
            executor.prepare(&own.plan).expect("a valid plan");
            assert!((run("its own plan", &own, executor) == last) == is_last, "{id}: frame {i}");
        }
    }
}
