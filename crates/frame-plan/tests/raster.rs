//! The software rasteriser.
#![allow(clippy::unwrap_used, reason = "tests")]

mod passes;

use frame_plan::cpu::CpuExecutor;
use frame_plan::{Cull, Executor, PassInfo, PassKind, PassSet, Plan, TextureFormat};
use passes::*;
use proptest::prelude::*;

fn run_with<T: bytemuck::NoUninit + bytemuck::AnyBitPattern>(
    passes: PassSet,
    threads: usize,
    plan: &Plan,
    name: &str,
) -> Vec<T> {
    let mut executor = CpuExecutor::new(passes, Some(threads)).unwrap();
    executor.prepare(plan).unwrap();
    executor.execute().unwrap();
    bytemuck::pod_collect_to_vec(&executor.read(plan.resource(name).unwrap()).unwrap())
}

fn run<T: bytemuck::NoUninit + bytemuck::AnyBitPattern>(plan: &Plan, name: &str) -> Vec<T> {
    run_with(PASSES, 2, plan, name)
}

/// How many triangles cover each texel of a 37 x 23 picture.
fn coverage(corners: &[[f32; 4]]) -> Vec<f32> {
    let plan = color_plan("glow", TextureFormat::Rgba16Float, [37, 23], corners);
    run::<[u16; 4]>(&plan, "picture").iter().map(|t| half::f16::from_bits(t[0]).to_f32()).collect()
}

/// A grid over the picture whose inner vertices are moved about (by less than a quarter of a cell, so that nothing folds), two triangles per cell, all with weight w.
fn grid(moves: &[(f32, f32)], columns: usize, w: f32) -> Vec<[f32; 4]> {
    let vertex = |i: usize, j: usize| {
        let inner = (1..columns).contains(&i) && (1..columns).contains(&j);
        let (dx, dy) = if inner { moves[(j * columns + i) % moves.len()] } else { (0.0, 0.0) };
        let step = 2.0 / columns as f32;
        [(-1.0 + (i as f32 + dx) * step) * 1.3 * w, (-1.0 + (j as f32 + dy) * step) * 1.3 * w, 0.5 * w, w]
    };
    (0..columns * columns)
        .flat_map(|cell| {
            let (i, j) = (cell % columns, cell / columns);
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [a, b, c, a, c, d]
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mesh_covers_each_texel_once(
        moves in prop::collection::vec((-0.2_f32..0.2, -0.2_f32..0.2), 16),
        columns in 1_usize..9,
        w in 0.1_f32..10.0,
    ) {
        let covered = coverage(&grid(&moves, columns, w));
        prop_assert_eq!(covered.iter().position(|&c| c != 1.0), None);
    }

    #[test]
    fn a_fan_through_texel_centres_covers_each_texel_once(column in 0_usize..37, row in 0_usize..23) {
        // The shared vertex and the edges to the corners run exactly through texel centres.
        let x = (column as f32 + 0.5) / 37.0 * 2.0 - 1.0;
        let y = 1.0 - (row as f32 + 0.5) / 23.0 * 2.0;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let fan: Vec<_> = (0..4)
            .flat_map(|i| {
                let ((ax, ay), (bx, by)) = (corners[i], corners[(i + 1) % 4]);
                [corner(x, y, 0.5), corner(ax, ay, 0.5), corner(bx, by, 0.5)]
            })
            .collect();
        let covered = coverage(&fan);
        prop_assert_eq!(covered.iter().position(|&c| c != 1.0), None);
    }
}

/// Negative control of the two properties above: the comparison sees a missing and a doubled triangle.
#[test]
fn coverage_sees_gaps_and_overlaps() {
    let whole = grid(&[(0.0, 0.0)], 4, 1.0);
    assert!(coverage(&whole[3..]).contains(&0.0));
    let doubled = [&whole[..], &whole[..3]].concat();
    assert!(coverage(&doubled).contains(&2.0));
}

#[test]
fn centres_on_left_and_top_edges_belong_to_the_triangle() {
    // 4 x 4 picture, square from centre (0.5, 0.5) to centre (2.5, 2.5): two texels per axis, the first ones.
    let at = |texel: f32| (texel + 0.5) / 2.0 - 1.0;
    let (low, high) = (at(0.0), at(2.0));
    let square = [
        corner(low, -high, 0.5),
        corner(high, -high, 0.5),
        corner(high, -low, 0.5),
        corner(low, -high, 0.5),
        corner(high, -low, 0.5),
        corner(low, -low, 0.5),
    ];
    let ids: Vec<u32> = run(&visibility_plan([4, 4], &square, 1), "ids");
    let covered: Vec<usize> = (0..16).filter(|&i| ids[i] != 0).collect();
    assert_eq!(covered, [0, 1, 4, 5]);
}

#[test]
fn nearest_wins_and_depth_is_kept() {
    let plane = |z: f32| [corner(-3.0, -1.0, z), corner(3.0, -1.0, z), corner(0.0, 5.0, z)];
    let order = [plane(0.75), plane(0.25), plane(0.5)].concat();
    let plan = visibility_plan([8, 8], &order, 1);
    assert!(run::<u32>(&plan, "ids").iter().all(|&id| id == 2));
    assert!(run::<f32>(&plan, "depths").iter().all(|&d| d == 0.25));
    assert!(run::<f32>(&plan, "depth").iter().all(|&d| d == 0.25));
}

fn visibility_with(cull: Cull) -> PassSet {
    let PassKind::Draw { targets, depth, additive, vertex, fragment, .. } = VISIBILITY.kind else {
        unreachable!()
    };
    let kind = PassKind::Draw { targets, depth, cull, additive, vertex, fragment };
    PassSet(vec![&*Box::leak(Box::new(PassInfo { kind, ..VISIBILITY })), &COPY_DEPTH].leak())
}

#[test]
fn culling_drops_by_winding() {
    let front = [corner(-3.0, -1.0, 0.5), corner(3.0, -1.0, 0.5), corner(0.0, 5.0, 0.5)];
    let back = [front[0], front[2], front[1]];
    for (cull, front_seen, back_seen) in
        [(Cull::None, true, true), (Cull::Back, true, false), (Cull::Front, false, true)]
    {
        for (corners, seen) in [(front, front_seen), (back, back_seen)] {
            let ids: Vec<u32> =
                run_with(visibility_with(cull), 2, &visibility_plan([4, 4], &corners, 1), "ids");
            assert!(ids.iter().all(|&id| (id != 0) == seen), "{cull:?}");
        }
    }
}

#[test]
fn varyings_are_perspective_correct_and_fragments_are_dropped() {
    // w grows from 1 on the left to 4 on the right of a triangle that covers the picture.
    let corners = [[-1.0, -1.0, 0.5, 1.0], [28.0, -4.0, 2.0, 4.0], [-1.0, 7.0, 0.5, 1.0]];
    let plan = color_plan("shaded", TextureFormat::Rgba32Float, [16, 16], &corners);
    let picture: Vec<[f32; 4]> = run(&plan, "picture");
    for y in 0..16 {
        for x in 0..16 {
            let texel = picture[y * 16 + x];
            if x < 3 {
                assert_eq!(texel, [0.0; 4]);
                continue;
            }
            // Screen position is linear in (barycentric / w): solve for the second corner's share.
            let sx = (x as f32 + 0.5) / 8.0 - 1.0;
            let screen_share = (sx + 1.0) / 8.0;
            let inverse_w = 1.0 - screen_share + screen_share / 4.0;
            let share = screen_share / 4.0 / inverse_w;
            assert!((texel[1] - share).abs() < 1e-5, "{x} {y}: {} {share}", texel[1]);
            assert!((texel[2] - inverse_w).abs() < 1e-5);
            assert_eq!(texel[3], 1.0);
        }
    }
}

#[test]
fn triangles_through_the_near_plane_and_behind_the_viewer_are_clipped() {
    // A floor y = -1 seen from the origin along -z (w = -z), reaching from before to behind the viewer.
    let near = 0.1;
    let project = |x: f32, z: f32| [x, -1.0, (-z - near) * 1.0, -z];
    let floor = [project(-50.0, 40.0), project(50.0, 40.0), project(0.0, -60.0)];
    let ids: Vec<u32> =
        run_with(visibility_with(Cull::None), 2, &visibility_plan([16, 16], &floor, 1), "ids");
    assert!(ids[..8 * 16].iter().all(|&id| id == 0), "nothing above the horizon");
    assert!(ids[15 * 16..].iter().all(|&id| id == 1), "the floor below");
    let not_a_number = [[f32::NAN, 0.0, 0.5, 1.0], corner(1.0, -1.0, 0.5), corner(1.0, 1.0, 0.5)];
    assert!(run::<u32>(&visibility_plan([4, 4], &not_a_number, 1), "ids").iter().all(|&id| id == 0));
    let degenerate = [corner(0.0, 0.0, 0.5); 3];
    assert!(run::<u32>(&visibility_plan([4, 4], &degenerate, 1), "ids").iter().all(|&id| id == 0));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let plan = visibility_plan([61, 47], &fan(), 3);
    let one: Vec<u32> = run_with(PASSES, 1, &plan, "ids");
    assert!(one.contains(&2003) && one.contains(&1), "several instances are seen");
    for threads in [2, 3, 7] {
        assert_eq!(run_with::<u32>(PASSES, threads, &plan, "ids"), one);
    }
    let glow = color_plan("glow", TextureFormat::Rgba16Float, [61, 47], &fan());
    assert_eq!(run_with::<u16>(PASSES, 1, &glow, "picture"), run_with::<u16>(PASSES, 5, &glow, "picture"));
}
