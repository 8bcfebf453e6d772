//! Host side of `shaders/shared/prt_picture.wgsl`: relit surfaces as a camera sees them.

use asm_core::shared::triangle::{NOTHING, Triangle};
use asm_core::shared::view::View;
use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::{MirrorArgs, TextureView};
use frame_plan::{Binding, BindingKind};
use glam::{Mat3, UVec2, UVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Uniform of passes that shade; mirrors `PrtPicture` in `shaders/shared/prt_picture.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtPicture {
    /// First column of the matrix from XYZ of radiance times pi to the picture: exposure, white balance.
    pub shown_from_x: Vec3,
    /// Blocks of four terms, of irradiance and of albedos.
    pub blocks: u32,
    /// Second column.
    pub shown_from_y: Vec3,
    /// Samples per pixel and axis.
    pub samples: u32,
    /// Third column.
    pub shown_from_z: Vec3,
    /// Index of the camera's view; its texels are samples.
    pub camera_view: u32,
    /// Pixels.
    pub size: UVec2,
    /// Padding.
    pub reserved: UVec2,
}

/// A triangle's corners; mirrors `PrtCorners`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtCorners {
    /// Their vertices.
    pub vertices: UVec3,
    /// What the surface reflects: index in `albedos`.
    pub albedo: u32,
    /// Texture coordinates.
    pub uv0: Vec2,
    /// At the second corner.
    pub uv1: Vec2,
    /// At the third corner.
    pub uv2: Vec2,
    /// Padding.
    pub reserved: Vec2,
}

/// What a surface reflects, as a map over its texture coordinates; mirrors `PrtAlbedo`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtAlbedo {
    /// Texels; row 0 is v = 0.
    pub map_size: UVec2,
    /// Its first texel in `index_maps`, or its first layer in `spectral_maps`.
    pub first: u32,
    /// 1: its map is one of `spectral_maps`.
    pub spectral: u32,
}

const fn binding(name: &'static str, kind: BindingKind) -> Binding {
    Binding { name, kind }
}

/// Bindings that all passes that shade have.
pub(crate) const BINDINGS: [Binding; 9] = [
    binding("triangles", BindingKind::Read),
    binding("views", BindingKind::Read),
    binding("visibility", BindingKind::Texture { uint: true, filter: false, array: false }),
    binding("corners", BindingKind::Read),
    binding("irradiance", BindingKind::Read),
    binding("albedos", BindingKind::Read),
    binding("index_maps", BindingKind::Read),
    binding("palette", BindingKind::Read),
    binding("picture", BindingKind::Write),
];

/// What passes that shade read.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: PrtPicture,
    /// Of all surfaces, in working units.
    pub triangles: &'a [Triangle],
    /// The camera's among them.
    pub views: &'a [View],
    /// What the camera sees.
    pub visibility: TextureView<'a>,
    /// Of each triangle.
    pub corners: &'a [PrtCorners],
    /// Vertex after vertex, block after block.
    pub irradiance: &'a [Vec4],
    /// What corners name.
    pub albedos: &'a [PrtAlbedo],
    /// Entries of the palette.
    pub index_maps: &'a [u32],
    /// Entry, block, colour-matching function.
    pub palette: &'a [Vec4],
}

/// What is seen at a sample.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where the corners' irradiance starts.
    first_blocks: UVec3,
    /// Of the corners.
    weights: Vec3,
    /// Texture coordinates.
    pub(crate) uv: Vec2,
}

impl<'a> Inputs<'a> {
    /// Those of a pass.
    pub(crate) fn bound(args: &MirrorArgs<'a>) -> Self {
        Self {
            params: args.params(),
            triangles: args.read("triangles"),
            views: args.read("views"),
            visibility: args.texture("visibility"),
            corners: args.read("corners"),
            irradiance: args.read("irradiance"),
            albedos: args.read("albedos"),
            index_maps: args.read("index_maps"),
            palette: args.read("palette"),
        }
    }

    /// A block of irradiance, between the corners.
    pub(crate) fn irradiance_at(&self, seen: &Seen, block: u32) -> Vec4 {
        let at = |corner: usize| self.irradiance[(seen.first_blocks[corner] + block) as usize];
        seen.weights.x * at(0) + seen.weights.y * at(1) + seen.weights.z * at(2)
    }

    /// Inner product with the palette's entry at the nearest texel of the albedo's index map.
    pub(crate) fn reflected_by_palette(&self, seen: &Seen, albedo: &PrtAlbedo) -> Vec3 {
        let place = fract(seen.uv) * albedo.map_size.as_vec2();
        // Rounding may take a fraction to 1.
        let texel = place.as_uvec2().min(albedo.map_size - 1);
        let entry = self.index_maps[(albedo.first + texel.y * albedo.map_size.x + texel.x) as usize];
        let mut xyz = Vec3::ZERO;
        for block in 0..self.params.blocks {
            let e = self.irradiance_at(seen, block);
            let at = 3 * (entry * self.params.blocks + block) as usize;
            xyz += Vec3::from_array([0, 1, 2].map(|c| self.palette[at + c].dot(e)));
        }
        xyz
    }

    /// XYZ of radiance times pi, and 1 where no surface is.
    fn radiance_at(&self, sample: UVec2, reflected: &impl Fn(&Self, &Seen, &PrtAlbedo) -> Vec3) -> Vec4 {
        let visible = self.visibility.load_uint(sample.x, sample.y);
        if visible == NOTHING {
            return Vec4::W;
        }
        let view = &self.views[self.params.camera_view as usize];
        let hit = self.triangles[visible as usize - 1].plane_hit(view.ray(sample.as_vec2() + 0.5));
        if !hit.crosses || hit.facing >= 0.0 {
            return Vec4::ZERO; // from behind it is black
        }
        // A rasteriser's idea of a triangle is coarser than this one: just outside is on the edge.
        let mut weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v).max(Vec3::ZERO);
        weights /= weights.x + weights.y + weights.z;
        let triangle = &self.corners[visible as usize - 1];
        let uv = weights.x * triangle.uv0 + weights.y * triangle.uv1 + weights.z * triangle.uv2;
        let seen = Seen { first_blocks: triangle.vertices * self.params.blocks, weights, uv };
        reflected(self, &seen, &self.albedos[triangle.albedo as usize]).extend(0.0)
    }

    /// The picture, per pixel XYZ and the share without a surface, where surfaces reflect irradiance as `reflected` says.
    pub(crate) fn shade(
        &self,
        picture: &mut [Vec4],
        reflected: impl Fn(&Self, &Seen, &PrtAlbedo) -> Vec3 + Sync,
    ) {
        let PrtPicture { shown_from_x, shown_from_y, shown_from_z, samples, size, .. } = self.params;
        let shown = Mat3::from_cols(shown_from_x, shown_from_y, shown_from_z);
        picture.par_chunks_mut(size.x as usize).take(size.y as usize).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let first = UVec2::new(x as u32, y as u32) * samples;
                let mut sum = Vec4::ZERO;
                for j in 0..samples {
                    for i in 0..samples {
                        sum += self.radiance_at(first + UVec2::new(i, j), &reflected);
                    }
                }
                let mean = sum / (samples * samples) as f32;
                *pixel = (shown * mean.truncate()).extend(mean.w);
            }
        });
    }
}

/// WGSL's: glam's own is towards zero.
pub(crate) fn fract(v: Vec2) -> Vec2 {
    v - v.floor()
}
