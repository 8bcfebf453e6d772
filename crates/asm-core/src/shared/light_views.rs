//! Host side of `shaders/shared/light_views.wgsl`: finding points in the views of a light.

use glam::{Vec2, Vec3};

use super::view::View;

/// Where a light's views see a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// One of the views sees it.
    pub found: bool,
    /// Which of the views.
    pub face: u32,
    /// Its index among all views.
    pub view: u32,
    /// Continuous texel coordinates.
    pub texel: Vec2,
}

/// The first of `faces` views from `first_view` on that holds `p`.
pub fn locate(views: &[View], first_view: u32, faces: u32, p: Vec3) -> Located {
    for face in 0..faces {
        let view = &views[(first_view + face) as usize];
        let at = view.project(p);
        if view.holds(&at) {
            return Located { found: true, face, view: first_view + face, texel: at.texel };
        }
    }
    Located { found: false, face: 0, view: first_view, texel: Vec2::ZERO }
}

/// Where the map of a light holds a point that one of its views from `landing_view` on sees. Maps have a view per face too,
/// which may show a part of it only, finer; where it is the same view, it is the same place.
pub fn on_map(views: &[View], at: Located, landing_view: u32, map_view: u32, p: Vec3) -> Located {
    if map_view == landing_view {
        return at;
    }
    let view = &views[(map_view + at.face) as usize];
    let place = view.project(p);
    Located {
        found: at.found && view.holds(&place),
        face: at.face,
        view: map_view + at.face,
        texel: place.texel,
    }
}

/// As [`locate`], but a point beside a single view is moved to the view's edge.
pub fn locate_clamped(views: &[View], first_view: u32, faces: u32, p: Vec3) -> Located {
    let exact = locate(views, first_view, faces, p);
    if exact.found || faces != 1 {
        return exact;
    }
    let view = &views[first_view as usize];
    let at = view.project(p);
    let last = view.size.as_vec2() - 0.5;
    Located { found: at.z > 0.0, face: 0, view: first_view, texel: at.texel.clamp(Vec2::splat(0.5), last) }
}
