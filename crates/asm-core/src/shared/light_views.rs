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
