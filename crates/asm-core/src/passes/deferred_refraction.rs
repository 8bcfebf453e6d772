//! Glass as a camera sees it. Twin of `shaders/deferred_refraction.wgsl`.

use std::sync::atomic::AtomicU32;

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{Mat3, UVec2, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    CROSSING_WGSL, EXIT_SEARCH_WGSL, LEDGER_WGSL, OPTICS_WGSL, REFRACT_WGSL, TRIANGLE_WGSL, VIEW_WGSL,
    VISIBILITY_TEXTURE, binding,
};
use crate::shared::crossing::cross_surface;
use crate::shared::exit_search::{Exit, Inside};
use crate::shared::flux::add_64;
use crate::shared::ledger::{END_LANDED, END_NO_EXIT, END_TOTAL};
use crate::shared::optics::Optics;
use crate::shared::triangle::{NOTHING, PlaneHit, SAME_SURFACE, TRIANGLE_OPEN, Triangle};
use crate::shared::view::{Ray, View};

/// Uniform of the pass; mirrors `DeferredRefraction` in `shaders/deferred_refraction.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DeferredRefraction {
    /// Pixels.
    pub size: UVec2,
    /// Samples per pixel and axis.
    pub samples: u32,
    /// Index of the camera's view; its texels are samples.
    pub camera_view: u32,
    /// Number of wavelengths.
    pub wavelengths: u32,
    /// Row length of `optics`.
    pub materials: u32,
    /// Guesses at each way through glass.
    pub exit_iterations: u32,
    /// Guesses at the background.
    pub background_iterations: u32,
    /// No way through glass is longer.
    pub exit_reach: f32,
    /// Total reflections that are followed.
    pub bounces: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// Padding.
    pub reserved0: u32,
}

/// K_n of a wavelength in XYZ, by columns; mirrors `ViewBand`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ViewBand {
    /// XYZ per X.
    pub from_x: Vec3,
    /// Padding.
    pub reserved0: u32,
    /// XYZ per Y.
    pub from_y: Vec3,
    /// Padding.
    pub reserved1: u32,
    /// XYZ per Z.
    pub from_z: Vec3,
    /// Padding.
    pub reserved2: u32,
}

/// At a background that the picture shows.
pub const SEEN: u32 = 0;
/// At a surface that something hides in the picture: what hides it is fetched.
pub const SEEN_HIDDEN: u32 = 1;
/// At a surface that goes on beside the picture: the picture's edge is fetched.
pub const SEEN_OUTSIDE: u32 = 2;
/// Past every surface that the picture shows: dark.
pub const SEEN_NOTHING: u32 = 3;
/// Totally reflected more often than is followed: dark.
pub const SEEN_TOTAL: u32 = 4;
/// No way out in the picture, or out of the wrong side of a facet: dark.
pub const SEEN_NO_EXIT: u32 = 5;
/// Number of ends.
pub const SEEN_ROWS: usize = 6;

/// All that an executor needs to build and run `deferred_refraction`.
pub const DEFERRED_REFRACTION: PassInfo = PassInfo {
    name: "deferred_refraction",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        REFRACT_WGSL,
        OPTICS_WGSL,
        LEDGER_WGSL,
        CROSSING_WGSL,
        EXIT_SEARCH_WGSL,
        include_str!("../../../../shaders/deferred_refraction.wgsl"),
    ],
    params_struct: "DeferredRefraction",
    params_bytes: size_of::<DeferredRefraction>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("bands", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("background", BindingKind::Read),
        binding("camera_visibility", VISIBILITY_TEXTURE),
        binding("glass_visibility", VISIBILITY_TEXTURE),
        binding("back_visibility", VISIBILITY_TEXTURE),
        binding("picture", BindingKind::Write),
        binding("counts", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let params: DeferredRefraction = args.params();
            let views: &[View] = args.read("views");
            let inputs = Inputs {
                params,
                view: &views[params.camera_view as usize],
                triangles: args.read("triangles"),
                bands: args.read("bands"),
                optics: args.read("optics"),
                background: args.read("background"),
                camera_visibility: args.texture("camera_visibility"),
                glass_visibility: args.texture("glass_visibility"),
                back_visibility: args.texture("back_visibility"),
            };
            deferred_refraction(&inputs, args.write("picture"), args.atomics("counts"));
        },
    },
};

/// What `deferred_refraction` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: DeferredRefraction,
    /// The camera.
    pub view: &'a View,
    /// All triangles.
    pub triangles: &'a [Triangle],
    /// Wavelengths.
    pub bands: &'a [ViewBand],
    /// Wavelength x material.
    pub optics: &'a [Optics],
    /// What the camera sees without glass, XYZ per sample.
    pub background: &'a [Vec4],
    /// Opaque surfaces.
    pub camera_visibility: TextureView<'a>,
    /// Refractors.
    pub glass_visibility: TextureView<'a>,
    /// Back faces of refractors.
    pub back_visibility: TextureView<'a>,
}

struct Seen {
    end: u32,
    distance: f32,
    xyz: Vec3,
}

fn unseen(end: u32) -> Seen {
    let end = if end == END_TOTAL { SEEN_TOTAL } else { SEEN_NO_EXIT };
    Seen { end, distance: 0.0, xyz: Vec3::ZERO }
}

/// CPU mirror.
pub fn deferred_refraction(inputs: &Inputs<'_>, picture: &mut [Vec4], counts: &[AtomicU32]) {
    let params = &inputs.params;
    picture.par_chunks_mut(params.size.x as usize).take(params.size.y as usize).enumerate().for_each(
        |(y, row)| {
            let mut ends = [0_u64; SEEN_ROWS];
            for (x, pixel) in row.iter_mut().enumerate() {
                let id = UVec2::new(x as u32, y as u32);
                let mut sum = Vec3::ZERO;
                for j in 0..params.samples {
                    for i in 0..params.samples {
                        sum += inputs.radiance_at(id * params.samples + UVec2::new(i, j), &mut ends);
                    }
                }
                let samples = (params.samples * params.samples) as f32;
                *pixel = (sum / samples).extend(0.0);
            }
            for (end, count) in ends.into_iter().enumerate() {
                add_64(&counts[2 * end..2 * end + 2], count);
            }
        },
    );
}

/// Number of samples of each end, from the words of `counts`.
pub(crate) fn end_counts(words: &[u32]) -> [u64; SEEN_ROWS] {
    std::array::from_fn(|end| u64::from(words[2 * end]) | u64::from(words[2 * end + 1]) << 32)
}

impl Inputs<'_> {
    /// Where a ray inside `object` leaves by faces that a layer shows.
    fn exit_in_layer(&self, ray: Ray, object: u32, layer: &TextureView<'_>) -> Option<Exit> {
        let inside = Inside { triangles: self.triangles, ray, object };
        inside.find_exit(self.view, self.params.exit_reach, self.params.exit_iterations, |texel| {
            layer.load_uint(texel.x, texel.y)
        })
    }

    /// The back faces that the camera sees, and after a reflection the front faces too.
    fn find_exit(&self, ray: Ray, object: u32, reflected: bool) -> Option<Exit> {
        let back = self.exit_in_layer(ray, object, &self.back_visibility);
        if !reflected || back.is_some_and(|b| b.contained) {
            return back;
        }
        let front = self.exit_in_layer(ray, object, &self.glass_visibility);
        let nearer = |front: &Exit| back.is_none_or(|back| front.hit.distance < back.hit.distance);
        front.filter(|front| front.contained || nearer(front)).or(back)
    }

    fn background_at(&self, at: Vec2) -> Vec3 {
        let size = self.view.size;
        let corner = (at - 0.5).floor();
        let share = (at - 0.5) - corner;
        let mut sum = Vec3::ZERO;
        for i in 0..4 {
            let side = UVec2::new(i & 1, i >> 1);
            let texel = (corner + side.as_vec2()).clamp(Vec2::ZERO, size.as_vec2() - 1.0).as_uvec2();
            let weight = (if side.x == 1 { share.x } else { 1.0 - share.x })
                * (if side.y == 1 { share.y } else { 1.0 - share.y });
            if weight > 0.0 {
                sum += weight * self.background[(texel.y * size.x + texel.x) as usize].truncate();
            }
        }
        sum
    }

    fn fetch(&self, end: u32, texel: Vec2, distance: f32) -> Seen {
        let at = texel.clamp(Vec2::splat(0.5), self.view.size.as_vec2() - 0.5);
        Seen { end, distance, xyz: self.background_at(at) }
    }

    /// Where a ray that has left glass meets what the camera sees: the plane of the surface under a guess is the next
    /// guess, from the surface behind the glass's own sample on.
    fn find_background(&self, sample: UVec2, ray: Ray) -> Seen {
        let nothing = Seen { end: SEEN_NOTHING, distance: 0.0, xyz: Vec3::ZERO };
        // What GLSL's refract() makes of total reflection goes nowhere.
        if ray.direction == Vec3::ZERO {
            return self.fetch(SEEN_TOTAL, self.view.project(ray.origin).texel, 0.0);
        }
        let mut distance = self.params.exit_reach;
        let mut visible = self.camera_visibility.load_uint(sample.x, sample.y);
        let mut last = NOTHING;
        let mut found = false;
        let mut contained = false; // the guess is on the surface itself, not only in its plane
        for _ in 0..self.params.background_iterations {
            let mut ahead = -1.0;
            let mut in_triangle = false;
            if visible != NOTHING {
                let hit = self.triangles[visible as usize - 1].plane_hit(ray);
                if hit.crosses {
                    ahead = hit.distance;
                    in_triangle = hit.inside();
                }
            }
            if ahead > -SAME_SURFACE {
                found = true;
                contained = in_triangle;
                distance = ahead.max(0.0);
                if visible == last {
                    break;
                }
                last = visible;
            } else {
                distance *= 0.5;
            }
            let texel = self.view.texel(ray.origin + distance * ray.direction);
            visible = self.camera_visibility.load_uint(texel.x, texel.y);
        }
        if !found {
            return nothing;
        }
        let at = self.view.project(ray.origin + distance * ray.direction);
        if at.z <= 0.0 || (!contained && !self.view.holds(&at)) {
            return nothing;
        }
        let mut end = SEEN;
        if !self.view.holds(&at) {
            end = SEEN_OUTSIDE;
        } else {
            let there = self.camera_visibility.load_uint(at.texel.x as u32, at.texel.y as u32);
            if there == NOTHING {
                end = SEEN_NOTHING;
            } else {
                let hit = self.triangles[there as usize - 1].plane_hit(ray);
                if !hit.crosses || (hit.distance - distance).abs() > 0.01 * distance + SAME_SURFACE {
                    end = SEEN_HIDDEN;
                }
            }
        }
        self.fetch(end, at.texel, distance)
    }

    /// What one wavelength sees through glass that the camera's ray meets at `hit`.
    fn see_through(
        &self,
        sample: UVec2,
        camera_ray: Ray,
        front: &Triangle,
        hit: &PlaneHit,
        wavelength: u32,
    ) -> Seen {
        let params = &self.params;
        let medium = self.optics[(wavelength * params.materials + front.material) as usize];
        let entering = hit.facing < 0.0;
        let normal = (if entering { 1.0 } else { -1.0 }) * front.interpolated_normal(hit);
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let first = cross_surface(camera_ray.direction, normal, front, eta, params.rule);
        if first.end != END_LANDED {
            return unseen(first.end);
        }
        let mut passes = (1.0 - first.reflectance) * medium.surface;
        let origin = camera_ray.origin + hit.distance * camera_ray.direction;
        let mut ray = Ray { origin, direction: first.direction };
        let open = front.flags & TRIANGLE_OPEN != 0;
        let mut in_glass = entering;
        let mut bounce = 0;
        while in_glass {
            let Some(exit) = self.find_exit(ray, front.object, bounce > 0) else {
                if open {
                    break; // the background is inside
                }
                return unseen(END_NO_EXIT);
            };
            passes *= (-medium.absorption * exit.hit.distance).exp();
            let back = &self.triangles[exit.triangle as usize];
            let origin = ray.origin + exit.hit.distance * ray.direction;
            let inwards = -back.interpolated_normal(&exit.hit);
            let out = cross_surface(ray.direction, inwards, back, 1.0 / medium.index, params.rule);
            if out.end == END_LANDED {
                passes *= (1.0 - out.reflectance) * medium.surface;
                ray = Ray { origin, direction: out.direction };
                in_glass = false;
            } else if out.end == END_TOTAL && bounce < params.bounces {
                let direction = (ray.direction - 2.0 * ray.direction.dot(inwards) * inwards).normalize();
                ray = Ray { origin, direction };
            } else {
                return unseen(out.end);
            }
            bounce += 1;
        }
        let mut seen = self.find_background(sample, ray);
        if in_glass {
            // What is kept along a ray is radiance over the square of the index.
            passes *= (-medium.absorption * seen.distance).exp() / (medium.index * medium.index);
        }
        seen.xyz *= passes;
        seen
    }

    /// XYZ of a sample, through the nearest refractor if there is one before what is opaque.
    fn radiance_at(&self, sample: UVec2, ends: &mut [u64; SEEN_ROWS]) -> Vec3 {
        let behind = self.background[(sample.y * self.view.size.x + sample.x) as usize].truncate();
        let visible = self.glass_visibility.load_uint(sample.x, sample.y);
        if visible == NOTHING {
            return behind;
        }
        let ray = self.view.ray(sample.as_vec2() + 0.5);
        let front = &self.triangles[visible as usize - 1];
        let hit = front.plane_hit(ray);
        if !hit.crosses {
            return behind;
        }
        let opaque = self.camera_visibility.load_uint(sample.x, sample.y);
        if opaque != NOTHING {
            let opaque_hit = self.triangles[opaque as usize - 1].plane_hit(ray);
            if opaque_hit.crosses && opaque_hit.distance <= hit.distance {
                return behind;
            }
        }
        let mut sum = Vec3::ZERO;
        for i in 0..self.params.wavelengths {
            let seen = self.see_through(sample, ray, front, &hit, i);
            ends[seen.end as usize] += 1;
            let band = &self.bands[i as usize];
            sum += Mat3::from_cols(band.from_x, band.from_y, band.from_z) * seen.xyz;
        }
        // Only now: bands one by one may be negative where their weights are of RGB.
        sum.max(Vec3::ZERO)
    }
}
