//! Glass and mirrors as a camera sees them. Twin of `shaders/deferred_refraction.wgsl`.

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
use crate::shared::crossing::{cross_surface, mirror_reflectance, reflect_at};
use crate::shared::exit_search::{EXIT_OF_BODY, Exit, Inside};
use crate::shared::flux::add_64;
use crate::shared::ledger::{END_LANDED, END_NO_EXIT, END_TOTAL};
use crate::shared::optics::Optics;
use crate::shared::triangle::{NOTHING, PlaneHit, SAME_SURFACE, TRIANGLE_MIRROR, TRIANGLE_OPEN, Triangle};
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
    /// Total reflections that are followed, and reflections at mirrors.
    pub bounces: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// 1 where there are any.
    pub mirrors: u32,
    /// The first guess at what a mirror shows.
    pub mirror_reach: f32,
    /// Index of the refractor that the eye is in + 1, or 0 in free space.
    pub eye_object: u32,
    /// Its material.
    pub eye_material: u32,
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
/// Reflected more often than is followed: dark.
pub const SEEN_TOTAL: u32 = 4;
/// No way out in the picture, or off the wrong side of a facet: dark.
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
    xyz: Vec3,
}

fn unseen(end: u32) -> Seen {
    let end = if end == END_TOTAL { SEEN_TOTAL } else { SEEN_NO_EXIT };
    Seen { end, xyz: Vec3::ZERO }
}

/// Where a ray meets what the camera sees.
#[derive(Clone, Copy)]
struct Background {
    end: u32,
    distance: f32,
    texel: Vec2,
    /// As in visibility buffers, where a mirror is met.
    mirror: u32,
}

/// Glass before what is opaque.
#[derive(Clone, Copy)]
struct Front<'a> {
    triangle: &'a Triangle,
    hit: PlaneHit,
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
        let inside = Inside { triangles: self.triangles, ray, object, side: EXIT_OF_BODY };
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

    fn is_mirror(&self, visible: u32) -> bool {
        self.params.mirrors == 1
            && visible != NOTHING
            && self.triangles[visible as usize - 1].flags & TRIANGLE_MIRROR != 0
    }

    /// What is matt there, between texels.
    fn background_at(&self, texel: Vec2) -> Vec3 {
        let size = self.view.size;
        let at = texel.clamp(Vec2::splat(0.5), size.as_vec2() - 0.5);
        let corner = (at - 0.5).floor();
        let share = (at - 0.5) - corner;
        let mut sum = Vec3::ZERO;
        let mut mirrors = 0.0;
        for i in 0..4 {
            let side = UVec2::new(i & 1, i >> 1);
            let place = (corner + side.as_vec2()).clamp(Vec2::ZERO, size.as_vec2() - 1.0).as_uvec2();
            let weight = (if side.x == 1 { share.x } else { 1.0 - share.x })
                * (if side.y == 1 { share.y } else { 1.0 - share.y });
            if weight > 0.0 {
                sum += weight * self.background[(place.y * size.x + place.x) as usize].truncate();
                if self.is_mirror(self.camera_visibility.load_uint(place.x, place.y)) {
                    mirrors += weight;
                }
            }
        }
        if mirrors > 0.0 && mirrors < 0.999 {
            sum /= 1.0 - mirrors;
        }
        sum
    }

    /// The plane of the surface under a guess is the next guess. `visible` is under the first one, at `reach`. Of mirrors only
    /// what is on the surface itself counts, since curved ones lie before many of their own planes.
    fn find_background(&self, reach: f32, mut visible: u32, ray: Ray) -> Background {
        // What GLSL's refract() makes of total reflection goes nowhere.
        if ray.direction == Vec3::ZERO {
            let texel = self.view.project(ray.origin).texel;
            return Background { end: SEEN_TOTAL, distance: 0.0, texel, mirror: NOTHING };
        }
        let nothing = Background { end: SEEN_NOTHING, distance: 0.0, texel: Vec2::ZERO, mirror: NOTHING };
        let mut distance = reach;
        let mut last = NOTHING;
        let mut found = false;
        let mut contained = false; // the guess is on the surface itself, not only in its plane
        for _ in 0..self.params.background_iterations {
            let mut ahead = -1.0;
            let mut in_triangle = false;
            if visible != NOTHING {
                let hit = self.triangles[visible as usize - 1].plane_hit(ray);
                in_triangle = hit.inside();
                if hit.crosses && (!self.is_mirror(visible) || (in_triangle && hit.distance > SAME_SURFACE)) {
                    ahead = hit.distance;
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
        let seen = |end, mirror| Background { end, distance, texel: at.texel, mirror };
        if !self.view.holds(&at) {
            return seen(SEEN_OUTSIDE, NOTHING);
        }
        let there = self.camera_visibility.load_uint(at.texel.x as u32, at.texel.y as u32);
        if there == NOTHING {
            return seen(SEEN_NOTHING, NOTHING);
        }
        let hit = self.triangles[there as usize - 1].plane_hit(ray);
        if !hit.crosses || (hit.distance - distance).abs() > 0.01 * distance + SAME_SURFACE {
            return seen(SEEN_HIDDEN, NOTHING);
        }
        seen(SEEN, if self.is_mirror(there) { there } else { NOTHING })
    }

    /// What one wavelength shows of `found` on a ray's way, where `absorption` is that of what it travels in: mirrors throw
    /// it on.
    fn see_background(&self, mut ray: Ray, mut found: Background, absorption: f32, wavelength: u32) -> Seen {
        let params = &self.params;
        let mut passes = (-absorption * found.distance).exp();
        let mut bounce = 0;
        while found.mirror != NOTHING {
            if bounce > params.bounces {
                return unseen(END_TOTAL);
            }
            let mirror = &self.triangles[found.mirror as usize - 1];
            let hit = mirror.plane_hit(ray);
            let normal = -hit.facing.signum() * mirror.interpolated_normal(&hit);
            let at_normal = self.optics[(wavelength * params.materials + mirror.material) as usize].surface;
            let reflectance = mirror_reflectance(ray.direction, normal, at_normal);
            let back = reflect_at(ray.direction, normal, mirror, reflectance);
            if back.end != END_LANDED {
                return unseen(back.end);
            }
            ray = Ray { origin: ray.origin + hit.distance * ray.direction, direction: back.direction };
            let guess = self.view.texel(ray.origin + params.mirror_reach * ray.direction);
            let visible = self.camera_visibility.load_uint(guess.x, guess.y);
            found = self.find_background(params.mirror_reach, visible, ray);
            passes *= back.reflectance * (-absorption * found.distance).exp();
            bounce += 1;
        }
        if found.end == SEEN_NOTHING {
            return Seen { end: SEEN_NOTHING, xyz: Vec3::ZERO };
        }
        Seen { end: found.end, xyz: passes * self.background_at(found.texel) }
    }

    /// What one wavelength sees through glass that the camera's ray meets at `front`, before or behind which `opaque` is seen.
    fn see_through(&self, opaque: u32, camera_ray: Ray, front: Front<'_>, wavelength: u32) -> Seen {
        let params = &self.params;
        let Front { triangle: front, hit } = front;
        let medium = self.optics[(wavelength * params.materials + front.material) as usize];
        let open = front.flags & TRIANGLE_OPEN != 0;
        let mut ray = camera_ray;
        let mut passes = 1.0;
        let mut in_glass = true;
        if hit.facing < 0.0 {
            let normal = front.interpolated_normal(&hit);
            let first = cross_surface(ray.direction, normal, front, medium.index, params.rule);
            if first.end != END_LANDED {
                return unseen(first.end);
            }
            passes *= (1.0 - first.reflectance) * medium.surface;
            ray = Ray { origin: ray.origin + hit.distance * ray.direction, direction: first.direction };
        } else {
            // What is kept along a ray is radiance over the square of the index.
            passes *= medium.index * medium.index;
        }
        let mut bounce = 0;
        while in_glass {
            let (back, exit_hit) = if bounce == 0 && hit.facing >= 0.0 {
                (front, hit)
            } else {
                // Behind an open surface a plane that is crossed beside its triangle says nothing.
                let exit = self.find_exit(ray, front.object, bounce > 0).filter(|e| !open || e.contained);
                match exit {
                    Some(exit) => (&self.triangles[exit.triangle as usize], exit.hit),
                    None if open => break, // the background is inside
                    None => return unseen(END_NO_EXIT),
                }
            };
            passes *= (-medium.absorption * exit_hit.distance).exp();
            let origin = ray.origin + exit_hit.distance * ray.direction;
            let inwards = -back.interpolated_normal(&exit_hit);
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
        let mut absorption = 0.0;
        if in_glass {
            absorption = medium.absorption;
            passes /= medium.index * medium.index;
        }
        let found = self.find_background(params.exit_reach, opaque, ray);
        let mut seen = self.see_background(ray, found, absorption, wavelength);
        seen.xyz *= passes;
        seen
    }

    /// XYZ of a sample: through the nearest refractor if there is one before what is opaque, by way of mirrors, and through what
    /// the eye is in.
    fn radiance_at(&self, sample: UVec2, ends: &mut [u64; SEEN_ROWS]) -> Vec3 {
        let params = &self.params;
        let behind = self.background[(sample.y * self.view.size.x + sample.x) as usize].truncate();
        let opaque = self.camera_visibility.load_uint(sample.x, sample.y);
        let glass = self.glass_visibility.load_uint(sample.x, sample.y);
        let mirror = self.is_mirror(opaque);
        if glass == NOTHING && !mirror && params.eye_object == 0 {
            return behind;
        }
        let texel = sample.as_vec2() + 0.5;
        let ray = self.view.ray(texel);
        let mut direct = Background { end: SEEN_NOTHING, distance: 0.0, texel, mirror: NOTHING };
        if opaque != NOTHING {
            let hit = self.triangles[opaque as usize - 1].plane_hit(ray);
            if hit.crosses {
                let mirror = if mirror { opaque } else { NOTHING };
                direct = Background { end: SEEN, distance: hit.distance, mirror, ..direct };
            }
        }
        let mut through = None;
        if glass != NOTHING {
            let triangle = &self.triangles[glass as usize - 1];
            let hit = triangle.plane_hit(ray);
            if hit.crosses && (direct.end == SEEN_NOTHING || hit.distance < direct.distance) {
                through = Some(Front { triangle, hit });
            }
        }
        if through.is_none() && !mirror && params.eye_object == 0 {
            return behind;
        }
        let mut sum = Vec3::ZERO;
        for i in 0..params.wavelengths {
            let seen = if let Some(front) = through {
                self.see_through(opaque, ray, front, i)
            } else {
                let mut absorption = 0.0;
                if params.eye_object != 0 {
                    absorption =
                        self.optics[(i * params.materials + params.eye_material) as usize].absorption;
                }
                self.see_background(ray, direct, absorption, i)
            };
            ends[seen.end as usize] += 1;
            let band = &self.bands[i as usize];
            sum += Mat3::from_cols(band.from_x, band.from_y, band.from_z) * seen.xyz;
        }
        // Only now: bands one by one may be negative where their weights are of RGB.
        sum.max(Vec3::ZERO)
    }
}
