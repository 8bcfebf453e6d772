//! Transfer against closed forms, on good and on bad meshes.

use std::f64::consts::PI;

use glam::DVec3;
use spectral_prt::{Bands, PrtError, Surface, Transfer, TransferSettings, cosine_lobe, precompute, sh};

fn settings(rays: u32) -> TransferSettings {
    TransferSettings { bands: Bands::default(), rays }
}

fn computed(surfaces: &[Surface], settings: TransferSettings) -> Transfer {
    precompute(surfaces, &settings, &mut |_| {}).expect("good settings")
}

/// A sphere with poles; normals are radial.
fn globe(rings: u32, turns: u32) -> Surface {
    let positions: Vec<DVec3> = (0..=rings)
        .flat_map(|i| {
            (0..turns).map(move |k| {
                let (theta, phi) =
                    (PI * f64::from(i) / f64::from(rings), 2.0 * PI * f64::from(k) / f64::from(turns));
                DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
            })
        })
        .collect();
    let triangles: Vec<[u32; 3]> = (0..rings)
        .flat_map(|i| (0..turns).map(move |k| (i * turns + k, i * turns + (k + 1) % turns)))
        .flat_map(|(a, b)| [[a, a + turns, b], [b, a + turns, b + turns]])
        .collect();
    Surface::new(&positions, &positions, &triangles).expect("a sphere")
}

/// Two triangles with these corners in order, flat.
fn quad(corners: [[f64; 3]; 4]) -> Surface {
    Surface::new(&corners.map(DVec3::from), &[], &[[0, 1, 2], [0, 2, 3]]).expect("a quad")
}

/// A small horizontal triangle at the origin whose three vertices look up.
fn probe() -> Surface {
    let corners = [DVec3::ZERO, DVec3::X * 1e-3, DVec3::Y * 1e-3];
    Surface::new(&corners, &[DVec3::Z; 3], &[[0, 1, 2]]).expect("a triangle")
}

fn first_vertex(transfer: &Transfer, surface: usize) -> Vec<f64> {
    transfer.surface(surface)[..transfer.bands().coefficients()].iter().map(|&t| f64::from(t)).collect()
}

/// Share of the cosine-weighted hemisphere that the first vertex sees.
fn visible_share(transfer: &Transfer, surface: usize) -> f64 {
    first_vertex(transfer, surface)[0] * 2.0 * PI.sqrt() / PI
}

#[test]
fn an_unblocked_vertex_has_the_clamped_cosine_exactly() {
    for bands in [1, 5, 10] {
        let bands = Bands::new(bands).unwrap();
        let sphere = globe(12, 17);
        let transfer = computed(std::slice::from_ref(&sphere), TransferSettings { bands, rays: 64 });
        let mut exact = vec![0.0; bands.coefficients()];
        for (t, normal) in transfer.surface(0).chunks(exact.len()).zip(sphere.normals()) {
            cosine_lobe::evaluate(bands, *normal, &mut exact);
            for (t, exact) in t.iter().zip(&exact) {
                assert_eq!(*t, *exact as f32, "{normal}");
            }
        }
    }
}

/// A wall as high as the sky on one side leaves half of it: of Y_00, pi / 2; of the direction away from the wall,
/// integral x z over a quarter of the sphere = 2 / 3; along the wall, nothing.
#[test]
fn a_high_wall_blocks_half_of_the_sky() {
    let far = 1e5;
    let wall = quad([[-1e-6, -far, 0.0], [-1e-6, far, 0.0], [-1e-6, far, far], [-1e-6, -far, far]]);
    let transfer = computed(&[probe(), wall], settings(1 << 16));
    let t = first_vertex(&transfer, 0);
    let y1 = (3.0 / (4.0 * PI)).sqrt();
    assert!((visible_share(&transfer, 0) - 0.5).abs() < 2e-4, "{}", visible_share(&transfer, 0));
    assert!((t[3] - y1 * 2.0 / 3.0).abs() < 5e-4, "{}", t[3]);
    assert!(t[1].abs() < 5e-4, "{}", t[1]);
    assert!((t[2] - y1 * PI / 3.0).abs() < 5e-4, "{}", t[2]);
}

/// A disc of radius r overhead at the height h hides r^2 / (r^2 + h^2) (configuration factor of a coaxial disc).
#[test]
fn a_disc_overhead_hides_its_configuration_factor() {
    let corners = 180;
    for (radius, height) in [(1.0, 1.0), (0.5, 2.0), (3.0, 1.0)] {
        let mut positions = vec![DVec3::new(0.0, 0.0, height)];
        positions.extend((0..corners).map(|k| {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(corners)).sin_cos();
            DVec3::new(radius * cos, radius * sin, height)
        }));
        let triangles: Vec<[u32; 3]> =
            (0..corners as u32).map(|k| [0, 1 + k, 1 + (k + 1) % corners as u32]).collect();
        let disc = Surface::new(&positions, &[], &triangles).unwrap();
        let transfer = computed(&[probe(), disc], settings(1 << 12));
        let hidden = radius * radius / (radius * radius + height * height);
        let share = visible_share(&transfer, 0);
        assert!((share - (1.0 - hidden)).abs() < 1e-3, "{radius} {height}: {share} {}", 1.0 - hidden);
    }
}

/// At the bottom of a long right-angled valley sin 45 degrees of the light is left (the strip's configuration factor),
/// though the blocking triangles touch the vertex itself; both ways round and at any scale.
#[test]
fn a_valley_blocks_what_its_own_sides_hide() {
    for scale in [1e-3, 1.0, 1e4] {
        let positions = [
            [0.0, -50.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 50.0, 0.0],
            [-1.0, -50.0, 1.0],
            [-1.0, 0.0, 1.0],
            [-1.0, 50.0, 1.0],
            [1.0, -50.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 50.0, 1.0],
        ]
        .map(|p| DVec3::from(p) * scale);
        let sides = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [1, 0, 6], [1, 6, 7], [2, 1, 7], [2, 7, 8]];
        for turned in [false, true] {
            let triangles = sides.map(|[a, b, c]| if turned { [a, c, b] } else { [a, b, c] });
            let surface = Surface::new(&positions, &[DVec3::Z; 9], &triangles).unwrap();
            let transfer = computed(&[surface], settings(1 << 14));
            let n = transfer.bands().coefficients();
            let share = f64::from(transfer.surface(0)[n]) * 2.0 * PI.sqrt() / PI;
            assert!((share - 0.5_f64.sqrt()).abs() < 2e-3, "{scale} {turned}: {share}");
        }
    }
}

/// The error falls as rays are added, and is where 1024 of them promise.
#[test]
fn more_rays_err_less() {
    let far = 1e5;
    let wall = || quad([[-1e-6, -far, 0.0], [-1e-6, far, 0.0], [-1e-6, far, far], [-1e-6, -far, far]]);
    let many = first_vertex(&computed(&[probe(), wall()], settings(1 << 18)), 0);
    let error = |rays| {
        let few = first_vertex(&computed(&[probe(), wall()], settings(rays)), 0);
        (few.iter().zip(&many).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / few.len() as f64).sqrt()
    };
    let errors = [64, 1024, 16_384].map(error);
    println!("RMS error of a coefficient at a wall, 64, 1024, 16384 rays: {errors:?}");
    assert!(errors[0] < 0.1 && errors[1] < errors[0] / 4.0 && errors[2] < errors[1] / 4.0, "{errors:?}");
    assert!(errors[1] < 5e-3);
}

#[test]
fn nothing_is_seen_inside_a_closed_body() {
    let inward: Vec<DVec3> = globe(16, 32).normals().iter().map(|n| -*n).collect();
    let shell = globe(16, 32);
    let inside = Surface::new(shell.positions(), &inward, shell.triangles()).unwrap();
    let transfer = computed(&[inside], settings(4096));
    for t in transfer.surface(0).chunks(25) {
        // What is left is the difference between sampled and exact integrals of the whole lobe.
        assert!(t.iter().all(|t| t.abs() < 5e-3), "{t:?}");
    }
}

/// A flat box seen from inside: its corners lie in the planes of three walls, and see none of the sky past them.
#[test]
fn a_corner_does_not_see_past_the_walls_that_meet_there() {
    for (scale, offset) in [(1.0, 0.0), (1e-3, 5.0), (1e4, -3e3)] {
        let corners: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * scale + offset)
            .collect();
        let walls = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = walls.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat();
        let room = Surface::new(&corners, &[], &triangles).unwrap();
        let transfer = computed(&[room], settings(512));
        for t in transfer.surface(0).chunks(25) {
            assert!(t[0].abs() < 1e-6, "{scale}: {}", t[0]);
        }
    }
}

#[test]
fn the_first_bands_are_what_fewer_bands_find() {
    let surfaces =
        [probe(), quad([[-1.0, 0.2, -2.0], [-1.0, 0.2, 2.0], [-1.0, 3.0, 2.0], [-1.0, 3.0, -2.0]])];
    let of =
        |bands| computed(&surfaces, TransferSettings { bands: Bands::new(bands).expect("bands"), rays: 64 });
    let all = of(6);
    for bands in 1..=6 {
        assert!(all.with_bands(Bands::new(bands).expect("bands")) == of(bands), "{bands}");
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let surfaces =
        [globe(24, 48), quad([[-2.0, -2.0, -1.1], [2.0, -2.0, -1.1], [2.0, 2.0, -1.1], [-2.0, 2.0, -1.1]])];
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| computed(&surfaces, settings(128)))
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(7));
    // There is something to compare: the floor takes light from the sphere's lower half.
    let blocked = one.surface(0).chunks(25).filter(|t| t[0] < 0.5).count();
    assert!(blocked > 100, "{blocked}");
}

#[test]
fn isolated_vertices_have_no_transfer_and_degenerate_triangles_block_nothing() {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::splat(0.5), DVec3::new(0.2, 0.2, 9.0)];
    let normals = [DVec3::Z, DVec3::Z, DVec3::Z, DVec3::ZERO, DVec3::ZERO];
    let surface = Surface::new(&positions, &normals, &[[0, 1, 2], [3, 3, 4], [4, 4, 4]]).unwrap();
    assert_eq!((surface.degenerate_triangles(), surface.isolated_vertices()), (2, &[3, 4][..]));
    let transfer = computed(std::slice::from_ref(&surface), settings(256));
    let mut exact = vec![0.0; 25];
    cosine_lobe::evaluate(Bands::default(), DVec3::Z, &mut exact);
    for vertex in 0..5 {
        let t = &transfer.surface(0)[25 * vertex..25 * (vertex + 1)];
        let expected: Vec<f32> = exact.iter().map(|&e| if vertex < 3 { e as f32 } else { 0.0 }).collect();
        assert_eq!(t, expected, "{vertex}");
    }
}

#[test]
fn bundled_scenes_have_transfer_without_a_word_about_their_meshes() {
    for name in ["ring", "gem", "organic"] {
        let scene = spectral_scene::bundled(name).unwrap();
        let surfaces: Vec<Surface> =
            (0..scene.objects.len()).map(|o| Surface::of_object(&scene, o).unwrap()).collect();
        let transfer = computed(&surfaces, settings(4));
        for (i, surface) in surfaces.iter().enumerate() {
            assert_eq!(transfer.surface(i).len(), 25 * surface.positions().len(), "{name}");
            assert!(transfer.surface(i).iter().all(|t| t.is_finite()), "{name}");
        }
    }
}

#[test]
fn rays_are_counted_and_progress_is_in_order() {
    for rays in [0, (1 << 20) + 1] {
        let refused = precompute(&[probe()], &settings(rays), &mut |_| {}).unwrap_err();
        assert!(matches!(refused, PrtError::Rays { got, max: 1_048_576 } if got == rays), "{refused}");
    }
    let mut heard = Vec::new();
    precompute(&[globe(40, 60)], &settings(1), &mut |share| heard.push(share)).unwrap();
    assert_eq!(heard, [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]);
}

/// Irradiance is linear in the light, and a constant sky of radiance 1 gives pi where nothing blocks.
#[test]
fn a_constant_sky_lights_an_open_surface_with_pi() {
    let transfer = computed(&[globe(8, 9)], settings(16));
    let mut sky = vec![0.0; 25];
    sky[0] = 2.0 * PI.sqrt();
    assert!((sh::value(Bands::default(), &sky, DVec3::X) - 1.0).abs() < 1e-15);
    for e in transfer.irradiance(0, &sky) {
        assert!((e / PI - 1.0).abs() < 1e-6, "{e}");
    }
}
