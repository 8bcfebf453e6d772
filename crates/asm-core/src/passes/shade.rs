//! What a camera sees by one light. Twin of `shaders/shade.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{Mat3, UVec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    EMISSION_WGSL, IRRADIANCE_WGSL, LIGHT_VIEWS_WGSL, REFRACT_WGSL, TRIANGLE_WGSL, VIEW_WGSL,
    VISIBILITY_TEXTURE, VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::irradiance::{Light, Lookup};
use crate::shared::refract::refract_light;
use crate::shared::triangle::{NOTHING, TRIANGLE_MIRROR, TRIANGLE_OPEN};
use crate::shared::view::Ray;

/// Uniform of the pass; mirrors `Shade` in `shaders/shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Shade {
    /// The light.
    pub light: Light,
    /// Pixels.
    pub size: UVec2,
    /// Samples per pixel and axis.
    pub samples: u32,
    /// Index of the camera's view; its texels are samples.
    pub camera_view: u32,
    /// Columns of the matrix from XYZ to linear sRGB.
    pub linear_srgb_from_x: Vec3,
    /// First of this light, in `surfaces`.
    pub first_surface: u32,
    /// Second column.
    pub linear_srgb_from_y: Vec3,
    /// Padding.
    pub reserved0: u32,
    /// Third column.
    pub linear_srgb_from_z: Vec3,
    /// Padding.
    pub reserved1: u32,
    /// Columns of its inverse.
    pub xyz_from_r: Vec3,
    /// Padding.
    pub reserved2: u32,
    /// Second column.
    pub xyz_from_g: Vec3,
    /// Padding.
    pub reserved3: u32,
    /// Third column.
    pub xyz_from_b: Vec3,
    /// Padding.
    pub reserved4: u32,
}

/// A material as a camera sees it by one light; mirrors `Surface`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Surface {
    /// XYZ of the light, in its lux or candela, that a matt surface reflects: integrated over the whole spectrum.
    pub reflected: Vec3,
    /// Refractive index at the d line.
    pub index: f32,
    /// Linear sRGB that the surface of glass lets pass.
    pub tint: Vec3,
    /// Padding.
    pub reserved0: u32,
    /// Of glass, linear sRGB, per working unit.
    pub absorption: Vec3,
    /// Padding.
    pub reserved1: u32,
}

/// All that an executor needs to build and run `shade`.
pub const SHADE: PassInfo = PassInfo {
    name: "shade",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        REFRACT_WGSL,
        LIGHT_VIEWS_WGSL,
        EMISSION_WGSL,
        IRRADIANCE_WGSL,
        include_str!("../../../../shaders/shade.wgsl"),
    ],
    params_struct: "Shade",
    params_bytes: size_of::<Shade>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("surfaces", BindingKind::Read),
        binding("caustic", BindingKind::Read),
        binding("camera_visibility", VISIBILITY_TEXTURE),
        binding("glass_visibility", VISIBILITY_TEXTURE),
        binding("back_visibility", VISIBILITY_TEXTURE),
        binding("direct_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("reflected_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("entry_visibility", VISIBILITY_TEXTURE),
        binding("picture", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let params: Shade = args.params();
            let inputs = Inputs {
                params,
                lookup: Lookup::bound(args, params.light),
                surfaces: args.read("surfaces"),
                camera_visibility: args.texture("camera_visibility"),
                glass_visibility: args.texture("glass_visibility"),
                back_visibility: args.texture("back_visibility"),
            };
            shade(&inputs, args.write("picture"));
        },
    },
};

/// What `shade` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: Shade,
    /// For irradiance.
    pub lookup: Lookup<'a>,
    /// Light x material.
    pub surfaces: &'a [Surface],
    /// Opaque surfaces from the camera.
    pub camera_visibility: TextureView<'a>,
    /// Refractors from the camera.
    pub glass_visibility: TextureView<'a>,
    /// Back faces of refractors from the camera.
    pub back_visibility: TextureView<'a>,
}

/// CPU mirror.
pub fn shade(inputs: &Inputs<'_>, picture: &mut [Vec4]) {
    let params = &inputs.params;
    picture.par_chunks_mut(params.size.x as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let id = UVec2::new(x as u32, y as u32);
            let mut sum = Vec3::ZERO;
            for j in 0..params.samples {
                for i in 0..params.samples {
                    sum += inputs.radiance_at(id * params.samples + UVec2::new(i, j));
                }
            }
            let samples = (params.samples * params.samples) as f32;
            *pixel += (sum / samples).extend(0.0);
        }
    });
}

impl Inputs<'_> {
    /// Linear sRGB that glass lets pass straight through, at a sample where `depth` is the distance of the surface behind.
    fn glass_tint(&self, sample: UVec2, ray: Ray, depth: f32) -> Vec3 {
        let triangles = self.lookup.triangles;
        let visible = self.glass_visibility.load_uint(sample.x, sample.y);
        if visible == NOTHING {
            return Vec3::ONE;
        }
        let front = &triangles[visible as usize - 1];
        let hit = front.plane_hit(ray);
        if !hit.crosses || hit.distance >= depth {
            return Vec3::ONE;
        }
        let surface = &self.surfaces[(self.params.first_surface + front.material) as usize];
        let normal = -hit.facing.signum() * front.interpolated_normal(&hit);
        let eta = if hit.facing < 0.0 { surface.index } else { 1.0 / surface.index };
        let passes = surface.tint * (1.0 - refract_light(ray.direction, normal, eta).reflectance);
        if hit.facing > 0.0 {
            return passes;
        }
        if front.flags & TRIANGLE_OPEN != 0 {
            return passes * (-surface.absorption * (depth - hit.distance)).exp();
        }
        let mut thickness = 0.0;
        let behind = self.back_visibility.load_uint(sample.x, sample.y);
        if behind != NOTHING && triangles[behind as usize - 1].object == front.object {
            let back = triangles[behind as usize - 1].plane_hit(ray);
            thickness = (back.distance - hit.distance).max(0.0);
        }
        passes * passes * (-surface.absorption * thickness).exp()
    }

    /// XYZ radiance along a sample's ray.
    fn radiance_at(&self, sample: UVec2) -> Vec3 {
        let visible = self.camera_visibility.load_uint(sample.x, sample.y);
        if visible == NOTHING {
            return Vec3::ZERO;
        }
        let params = &self.params;
        let ray = self.lookup.views[params.camera_view as usize].ray(sample.as_vec2() + 0.5);
        let t = &self.lookup.triangles[visible as usize - 1];
        let hit = t.plane_hit(ray);
        // A mirror has no colour of its own.
        if !hit.crosses || t.flags & TRIANGLE_MIRROR != 0 {
            return Vec3::ZERO;
        }
        let point = ray.origin + hit.distance * ray.direction;
        // Of the side that is seen.
        let normal = -hit.facing.signum() * t.interpolated_normal(&hit);
        let light = self.lookup.irradiance_at(point, normal, visible);
        let reflected = self.surfaces[(params.first_surface + t.material) as usize].reflected;
        let xyz =
            std::f32::consts::FRAC_1_PI * (light.direct * reflected + light.refracted + light.reflected);
        self.tinted(xyz, self.glass_tint(sample, ray, hit.distance))
    }

    /// XYZ times a colour of linear sRGB. Spectral light lies outside sRGB: times a colour it may leave XYZ's positive octant,
    /// which no light does.
    fn tinted(&self, xyz: Vec3, tint: Vec3) -> Vec3 {
        if tint == Vec3::splat(tint.x) {
            return tint.x * xyz;
        }
        let params = &self.params;
        let linear_srgb_from_xyz =
            Mat3::from_cols(params.linear_srgb_from_x, params.linear_srgb_from_y, params.linear_srgb_from_z);
        let xyz_from_linear_srgb = Mat3::from_cols(params.xyz_from_r, params.xyz_from_g, params.xyz_from_b);
        (xyz_from_linear_srgb * (tint * (linear_srgb_from_xyz * xyz))).max(Vec3::ZERO)
    }
}
