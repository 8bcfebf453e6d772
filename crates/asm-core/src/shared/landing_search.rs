//! Host side of `shaders/shared/landing_search.wgsl`: where a ray lands, from what views show.

use frame_plan::cpu::TextureView;
use glam::{Vec2, Vec3};

use super::ledger::*;
use super::light_views::{Located, locate, locate_clamped};
use super::photons::Photons;
use super::triangle::{NOTHING, SAME_SURFACE, Triangle, visible_in_layer};
use super::view::{Ray, View};

/// Shah's update: the distance of the surface point below the last guess.
pub const LANDING_DISTANCE: u32 = 0;
/// The ray against the plane of the triangle below the last guess.
pub const LANDING_PLANE: u32 = 1;

/// What is searched.
#[derive(Clone, Copy)]
pub struct LandingSearch<'a> {
    /// How.
    pub photons: &'a Photons,
    /// All triangles.
    pub triangles: &'a [Triangle],
    /// All views.
    pub views: &'a [View],
    /// First opaque surface from the light behind the front of the glass.
    pub landing_visibility: TextureView<'a>,
}

/// Where a ray lands.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    /// `END_LANDED`, `END_OUTSIDE_MAP` or `END_ESCAPED`.
    pub end: u32,
    /// In the landing views.
    pub at: Located,
    /// What is lit; [`NOTHING`] where nothing is.
    pub visible: u32,
    /// Along the ray.
    pub distance: f32,
    /// Away from the surface.
    pub astray: bool,
    /// `END_OUTSIDE_MAP`, but to be put down.
    pub beside: bool,
}

impl LandingSearch<'_> {
    /// A place that no surface covers in the view lies where a surface nearby would go on: what arrives there blurs into the
    /// surface as much as what arrives on it blurs out.
    fn beside_surface(&self, at: &Located, ray: Ray, distance: f32) -> u32 {
        let guard = self.photons.guard_texels;
        let size = self.views[at.view as usize].size.as_vec2();
        for i in 0..8 {
            let side = i + i / 4; // the eight places round the middle of 3 x 3
            let offset = guard * Vec2::new((side % 3) as f32 - 1.0, (side / 3) as f32 - 1.0);
            let texel = (at.texel + offset).clamp(Vec2::ZERO, size - 1.0).as_uvec2();
            let visible = visible_in_layer(&self.landing_visibility, texel, at.face);
            if visible != NOTHING {
                let hit = self.triangles[visible as usize - 1].plane_hit(ray);
                if hit.crosses && (hit.distance - distance).abs() <= 0.01 * distance + SAME_SURFACE {
                    return visible;
                }
            }
        }
        NOTHING
    }

    /// What the map's view shows where it sees a point; where that is nothing, what it shows of the receivers' middle.
    fn landing_triangle(&self, at: &Located) -> u32 {
        let visible = visible_in_layer(&self.landing_visibility, at.texel.as_uvec2(), at.face);
        if visible != NOTHING {
            return visible;
        }
        let params = self.photons;
        let middle =
            locate_clamped(self.views, params.landing_view, params.landing_faces, params.landing_center);
        visible_in_layer(&self.landing_visibility, middle.texel.as_uvec2(), middle.face)
    }

    /// Shah's rayGeo: project the guess into the light's view, see what surface is there, guess again.
    pub fn find(&self, ray: Ray) -> Landing {
        let params = self.photons;
        let mut distance = (params.landing_center - ray.origin).dot(ray.direction).max(0.0);
        let mut last = NOTHING;
        for _ in 0..params.landing_iterations {
            let guess = ray.origin + distance * ray.direction;
            let at = locate_clamped(self.views, params.landing_view, params.landing_faces, guess);
            let visible = if at.found { self.landing_triangle(&at) } else { NOTHING };
            if visible == NOTHING {
                distance *= 0.5;
                continue;
            }
            let triangle = &self.triangles[visible as usize - 1];
            let ahead = triangle.plane_hit(ray);
            if params.landing_update == LANDING_PLANE && ahead.crosses && ahead.distance >= 0.0 {
                distance = ahead.distance;
                if visible == last {
                    break; // the same plane again
                }
                last = visible;
                continue;
            }
            let light_ray = self.views[at.view as usize].ray_through(guess);
            let below = triangle.plane_hit(light_ray);
            if below.crosses {
                distance = (light_ray.origin + below.distance * light_ray.direction - ray.origin).length();
            }
        }
        let point = ray.origin + distance * ray.direction;
        let at = locate(self.views, params.landing_view, params.landing_faces, point);
        let ended = |end| Landing { end, at, visible: NOTHING, distance, astray: false, beside: false };
        if !at.found {
            return ended(END_OUTSIDE_MAP);
        }
        let visible = visible_in_layer(&self.landing_visibility, at.texel.as_uvec2(), at.face);
        if visible == NOTHING {
            let near =
                if params.guard_texels > 0.0 { self.beside_surface(&at, ray, distance) } else { NOTHING };
            return Landing { visible: near, beside: near != NOTHING, ..ended(END_OUTSIDE_MAP) };
        }
        let triangle = &self.triangles[visible as usize - 1];
        // What GLSL's refract() makes of total reflection goes nowhere: it stays under the place where it happened.
        if ray.direction == Vec3::ZERO {
            return Landing { visible, distance: 0.0, astray: true, ..ended(END_LANDED) };
        }
        let hit = triangle.plane_hit(ray);
        if !hit.crosses || hit.distance < -SAME_SURFACE {
            return ended(END_ESCAPED);
        }
        let light_hit = triangle.plane_hit(self.views[at.view as usize].ray_through(point));
        if hit.facing * light_hit.facing <= 0.0 {
            return ended(END_OUTSIDE_MAP);
        }
        let astray = (hit.distance - distance).abs() > 0.01 * distance + SAME_SURFACE;
        Landing { visible, astray, ..ended(END_LANDED) }
    }
}
