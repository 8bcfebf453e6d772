//! The pond on the stage, seen from above: x to the right, y down, as in its pictures. And back: where on the water a point is.

use egui::{Pos2, Rect, Vec2, vec2};

/// Around the pond, points.
const MARGIN: f32 = 12.0;

/// The part of the stage that a pond of this length in x and y covers: as large as it can be, in its own proportions.
pub(super) fn covered(stage: Rect, extent_m: [f64; 2]) -> Rect {
    let room = stage.shrink(MARGIN.min(0.25 * stage.size().min_elem())).size();
    let proportions = vec2(extent_m[0] as f32, extent_m[1] as f32);
    let points_per_m = (room / proportions).min_elem();
    Rect::from_center_size(stage.center(), points_per_m * proportions)
}

/// The place on the water that is drawn at `point`, metres; none beside it.
pub(super) fn water_at(covered: Rect, extent_m: [f64; 2], point: Pos2) -> Option<[f64; 2]> {
    let part: Vec2 = (point - covered.min) / covered.size();
    let inside = |part: f32| (0.0..=1.0).contains(&part);
    (inside(part.x) && inside(part.y))
        .then(|| [f64::from(part.x) * extent_m[0], f64::from(part.y) * extent_m[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    const STAGE: Rect = Rect { min: Pos2 { x: 390.0, y: 0.0 }, max: Pos2 { x: 1280.0, y: 800.0 } };

    /// Where the picture, drawn over all that is covered, shows a place on the water.
    fn drawn_at(covered: Rect, extent_m: [f64; 2], position_m: [f64; 2]) -> Pos2 {
        let part = [0, 1].map(|k| (position_m[k] / extent_m[k]) as f32);
        covered.min + vec2(part[0], part[1]) * covered.size()
    }

    #[test]
    fn the_pond_keeps_its_proportions_inside_the_stage() {
        for extent_m in [[1.0, 1.0], [4.0, 1.0], [0.2, 3.0]] {
            let covered = covered(STAGE, extent_m);
            assert!(STAGE.contains_rect(covered), "{covered}");
            let proportions = f64::from(covered.width() / covered.height()) / (extent_m[0] / extent_m[1]);
            assert!((proportions - 1.0).abs() < 1e-4, "{extent_m:?}: {proportions}");
            let touches = (covered.width() - STAGE.width() + 2.0 * MARGIN).abs() < 1e-2
                || (covered.height() - STAGE.height() + 2.0 * MARGIN).abs() < 1e-2;
            assert!(touches, "{covered}");
        }
        // A window as small as it gets still has a pond.
        assert!(covered(Rect::from_min_size(Pos2::ZERO, vec2(2.0, 1.0)), [1.0, 1.0]).is_positive());
    }

    #[test]
    fn a_point_is_drawn_where_a_click_finds_it() {
        let extent_m = [2.0, 1.5];
        let covered = covered(STAGE, extent_m);
        for position_m in [[0.0, 0.0], [0.3, 1.2], [1.0, 0.75], [2.0, 1.5]] {
            let point = drawn_at(covered, extent_m, position_m);
            // Half a hundredth of a point, for corners that round to the outside.
            let point = point + 0.005 * (covered.center() - point).normalized();
            let found = water_at(covered, extent_m, point).expect("on the water");
            for (found, wanted) in found.iter().zip(position_m) {
                assert!((found - wanted).abs() < 1e-4, "{position_m:?}: {found}");
            }
        }
    }

    #[test]
    fn y_grows_downwards_and_beside_the_water_is_none() {
        let covered = covered(STAGE, [1.0, 1.0]);
        let at = |point| water_at(covered, [1.0, 1.0], point);
        let upper = at(covered.center() - vec2(0.0, 100.0)).expect("on the water");
        assert!(upper[1] < 0.5 && (upper[0] - 0.5).abs() < 1e-6, "{upper:?}");
        for beside in [pos2(395.0, 5.0), covered.min - vec2(1.0, -50.0), covered.max + vec2(0.0, 1.0)] {
            assert_eq!(at(beside), None, "{beside}");
        }
    }
}
