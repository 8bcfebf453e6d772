//! Frames against [`spectral_prt::Sky`] in f64, and what frames may change.

use asm_core::Picture;
use frame_plan::Executor;
use glam::{DMat3, DVec2, DVec3};
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_prt::sh::ShRotation;
use spectral_prt::{
    Bands, BounceSettings, Exposure, Palette, Projection, SceneTransfer, Shot, Sky, Surface, add_bounces,
};
use spectral_scene::Camera;

use crate::stage::*;

/// What a camera sees in f64: radiance between the corners of the nearest triangle that each pixel's centre is well inside of.
pub(crate) fn expected(
    surfaces: &[Surface],
    radiance: &[Vec<[f64; 3]>],
    camera: &Camera,
    [width, height]: [u32; 2],
) -> Vec<Option<[f64; 3]>> {
    let frame = camera.world_from_camera;
    let eye = frame.w_axis.truncate();
    let tan = (0.5 * camera.yfov_rad).tan();
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let middle = 0.5 * DVec2::new(f64::from(width), f64::from(height));
            let slope = (at - middle) * DVec2::new(1.0, -1.0) * (tan / middle.y);
            let direction = frame.transform_vector3(slope.extend(-1.0));
            let mut nearest = (f64::INFINITY, None);
            for (surface, radiance) in surfaces.iter().zip(radiance) {
                for t in surface.triangles() {
                    let [a, b, c] = t.map(|v| surface.positions()[v as usize]);
                    let n = (b - a).cross(c - a);
                    let facing = direction.dot(n);
                    let q = direction.cross(eye - a);
                    let (u, v) = (q.dot(c - a) / facing, -q.dot(b - a) / facing);
                    let distance = -(eye - a).dot(n) / facing;
                    // Pixels near an edge are another matter: rasterisers differ there.
                    let inside = u.min(v).min(1.0 - u - v);
                    if inside > -0.02 && distance > 0.0 && distance < nearest.0 {
                        let outside = direction.dot(surface.normals()[t[0] as usize]) < 0.0;
                        let weights = [1.0 - u - v, u, v];
                        let xyz = [0, 1, 2]
                            .map(|k| (0..3).map(|i| weights[i] * radiance[t[i] as usize][k]).sum::<f64>());
                        nearest = (distance, (inside > 0.02 && outside).then_some(xyz));
                    }
                }
            }
            pixels.push(nearest.1);
        }
    }
    pixels
}

/// The largest difference over the largest Y, and how many pixels were compared.
pub(crate) fn difference(picture: &Picture, expected: &[Option<[f64; 3]>]) -> (f64, usize) {
    let brightest = expected.iter().flatten().map(|xyz| xyz[1]).fold(0.0, f64::max);
    let pairs = picture.xyz.iter().zip(expected).filter_map(|(got, want)| Some((got, (*want)?)));
    let worst = pairs.flat_map(|(got, want)| (0..3).map(move |c| (f64::from(got[c]) - want[c]).abs()));
    (worst.fold(0.0, f64::max) / brightest, expected.iter().flatten().count())
}

/// A ball in front of a wall.
pub(crate) fn ball_and_wall() -> Vec<Surface> {
    let wall: Vec<DVec3> = square().0.positions().iter().map(|p| *p * 3.0 - DVec3::Z * 1.5).collect();
    vec![
        ball(DMat3::IDENTITY, true),
        Surface::new(&wall, &[DVec3::Z; 4], &[[0, 3, 1], [1, 3, 2]]).expect("a wall"),
    ]
}

#[test]
fn a_frame_shows_what_the_sky_shows_in_f64() {
    let surfaces = ball_and_wall();
    let transfer = transfer(&surfaces, 64);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[14].clone(), chart[17].clone()];
    let camera = camera(DVec3::new(1.0, 1.5, 4.0));
    let basis = basis(5);
    for projection in [Projection::Spectral(&basis), RGB] {
        let mut stage = Stage::new(&surfaces, &transfer, &projection, &paints);
        stage.settings.size = [72, 48];
        let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::Fl2)));
        let turn = DMat3::from_axis_angle(DVec3::new(0.3, 1.0, 0.2).normalize(), 0.7);
        let rotation = ShRotation::new(Bands::default(), turn).expect("a rotation");
        let radiance = |sky: &Sky| {
            let of = |s: usize| sky.radiance_xyz(&transfer, s, &projection.albedo(&paints[s])[0]);
            vec![of(0), of(1)]
        };
        let truth = expected(&surfaces, &radiance(&sky.rotated(&rotation)), &camera, stage.settings.size);
        let picture = stage.picture(&Shot { rotation: turn, ..shot(&sky, &camera) });
        let (worst, compared) = difference(&picture, &truth);
        println!("frame against f64: {worst:.1e} of the largest Y in {compared} pixels");
        assert!(compared > 1000 && worst < 1e-5, "{worst} in {compared} pixels");
        // Another rotation, another paint, another camera: all are seen.
        let unturned = stage.picture(&shot(&sky, &camera));
        assert!(difference(&unturned, &truth).0 > 1e-2);
        stage.palette = Palette::new(&projection, &[paints[1].clone(), paints[0].clone()]);
        let repainted = stage.picture(&Shot { rotation: turn, ..shot(&sky, &camera) });
        assert!(difference(&repainted, &truth).0 > 1e-2);
    }
}

/// A red and a white wall of a corner: red light on the white one, and more of it than without bounces.
#[test]
fn a_frame_with_interreflection_shows_what_the_sky_shows_in_f64() {
    let floor: Vec<DVec3> = square().0.positions().iter().map(|p| DVec3::new(p.x, -1.0, p.y + 1.0)).collect();
    let surfaces =
        [square().0, Surface::new(&floor, &[DVec3::Y; 4], &[[0, 1, 3], [1, 2, 3]]).expect("a floor")];
    let direct = transfer(&surfaces, 64);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[14].clone(), chart[18].clone()];
    let settings = BounceSettings { rays: 64, bounces: 2 };
    let bounced =
        add_bounces(&surfaces, &direct, GRID, &paints, &settings, &mut |_| {}).expect("good settings");
    assert!(bounced.functions().len() > 1);
    let basis = basis(6);
    let projection = Projection::Bounced(&basis, &bounced);
    let camera = camera(DVec3::new(1.0, 1.5, 4.0));
    let sky = from_direction(DVec3::new(1.0, 2.0, 1.5), &projection.light(&light(Illuminant::D50)));
    let mut stage = Stage::new(&surfaces, &direct, &projection, &paints);
    stage.transfer = SceneTransfer::Bounced(&bounced);
    let of = |s: usize| sky.bounced_radiance_xyz(&bounced, s, &projection.albedo(&paints[s]));
    let truth = expected(&surfaces, &[of(0), of(1)], &camera, stage.settings.size);
    let (worst, compared) = difference(&stage.picture(&shot(&sky, &camera)), &truth);
    println!("interreflection against f64: {worst:.1e} of the largest Y in {compared} pixels");
    assert!(compared > 200 && worst < 1e-5, "{worst} in {compared} pixels");
    let projection = Projection::Spectral(&basis);
    let stage = Stage::new(&surfaces, &direct, &projection, &paints);
    assert!(difference(&stage.picture(&shot(&sky, &camera)), &truth).0 > 1e-2);
}

/// The sky turned by R and a camera in front of the object: what a camera sees in front of the object turned back.
#[test]
fn turning_the_sky_is_turning_object_and_camera_back() {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let paint = [color_checker::sampled(&GRID)[14].clone()];
    let sky = from_direction(DVec3::new(1.0, 0.2, 0.4), &projection.light(&light(Illuminant::D65)));
    let seen_by = camera(DVec3::new(0.5, 1.0, 4.0));
    let still = [ball(DMat3::IDENTITY, true)];
    let back = [ball(turn.transpose(), true)];
    let (of_still, of_back) = (transfer(&still, 1), transfer(&back, 1));
    let a = Stage::new(&still, &of_still, &projection, &paint)
        .picture(&Shot { rotation: turn, ..shot(&sky, &seen_by) });
    let turned_back = turned(&seen_by, turn.transpose());
    let b = Stage::new(&back, &of_back, &projection, &paint).picture(&shot(&sky, &turned_back));
    let brightest = seen(&a).map(|xyz| xyz[1]).fold(0.0, f64::max);
    let darkest = seen(&a).map(|xyz| xyz[1]).fold(f64::INFINITY, f64::min);
    assert!(darkest < 0.5 * brightest, "there is something to see");
    // Triangles' edges at the silhouette are rounded elsewhere.
    let differ = |b: &Picture| {
        let pairs = a.xyz.iter().zip(&b.xyz);
        pairs.filter(|(a, b)| (0..3).any(|c| f64::from((a[c] - b[c]).abs()) > 2e-5 * brightest)).count()
    };
    assert!(differ(&b) <= 4, "{} pixels", differ(&b));
    let unturned = Stage::new(&still, &of_still, &projection, &paint).picture(&shot(&sky, &seen_by));
    assert!(differ(&unturned) > 200);
}

#[test]
fn frames_change_by_numbers_alone() {
    let surfaces = ball_and_wall();
    let transfer = transfer(&surfaces, 16);
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let chart = color_checker::sampled(&GRID);
    let stage = Stage::new(&surfaces, &transfer, &projection, &[chart[2].clone(), chart[9].clone()]);
    let skies = [Illuminant::D65, Illuminant::A]
        .map(|i| from_direction(DVec3::new(1.0, 1.0, 1.0), &projection.light(&light(i))));
    let cameras = [DVec3::new(0.0, 1.0, 4.0), DVec3::new(2.0, 0.5, 3.0)].map(camera);
    let turn = DMat3::from_rotation_y(0.8);
    let first = shot(&skies[0], &cameras[0]);
    let exposure = Exposure { factor: 0.5, balance: None };
    let shots = [
        first,
        Shot { sky: &skies[1], ..first },
        Shot { rotation: turn, ..first },
        Shot { camera: &cameras[1], ..first },
        Shot { exposure, ..first },
        Shot { sky: &skies[1], rotation: turn, camera: &cameras[1], exposure },
    ];
    let relighting = stage.plan(&first).expect("a plan");
    let mut executor = executor(&relighting);
    let mut made = None;
    let mut pictures: Vec<Picture> = Vec::new();
    for shot in &shots {
        relighting.write(&mut executor, shot).expect("a good shot");
        let picture = frame(&relighting, &mut executor);
        assert!(*made.get_or_insert(executor.made()) == executor.made(), "frames make nothing");
        assert!(picture == stage.picture(shot), "a frame is the first frame of its own plan");
        assert!(!pictures.contains(&picture), "every change is seen");
        pictures.push(picture);
    }
    relighting.write(&mut executor, &first).expect("a good shot");
    assert!(frame(&relighting, &mut executor) == pictures[0]);
    let halved = pictures[0].xyz.iter().zip(&pictures[4].xyz);
    assert!(halved.flat_map(|(a, b)| (0..3).map(move |c| (0.5 * a[c] - b[c]).abs() / 1e4)).all(|d| d < 1e-6));
}

/// Pixels are means of their samples, and what looks away is black.
#[test]
fn pixels_are_means_of_samples_and_backs_are_black() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let of_ball = transfer(&surfaces, 1);
    let white = [GRID.sample(|_| 1.0)];
    let camera = camera(DVec3::new(0.0, 1.0, 4.0));
    let sky = from_direction(DVec3::new(1.0, 1.0, 1.0), &RGB.light(&light(Illuminant::D65)));
    let mut stage = Stage::new(&surfaces, &of_ball, &RGB, &white);
    stage.settings.size = [96, 64];
    let fine = stage.picture(&shot(&sky, &camera));
    stage.settings = spectral_prt::RelightingSettings { size: [48, 32], samples: 2 };
    let coarse = stage.picture(&shot(&sky, &camera));
    for (i, pixel) in coarse.xyz.iter().enumerate() {
        let (x, y) = (2 * (i % 48), 2 * (i / 48));
        let mean = [0, 1, 96, 97].map(|k| fine.xyz[96 * y + x + k][1]).iter().sum::<f32>() / 4.0;
        assert!((pixel[1] - mean).abs() <= 1e-6 * 1e4, "{} {mean}", pixel[1]);
    }
    let inside_out = [ball(DMat3::IDENTITY, false)];
    let of_inside_out = transfer(&inside_out, 1);
    let stage = Stage::new(&inside_out, &of_inside_out, &RGB, &white);
    assert_eq!(seen(&stage.picture(&shot(&sky, &camera))).count(), 0);
}
