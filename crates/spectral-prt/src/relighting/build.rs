//! Resources and steps of a plan.

use asm_core::passes::visibility::{VISIBILITY_ALL_FACES, Visibility};
use bytemuck::{NoUninit, Zeroable};
use frame_plan::{
    Decision, Lifetime, Limits, Load, ParamsId, PassStep, Plan, Resource, ResourceId, ResourceKind, Step,
    Target, Targets, TextureFormat,
};
use glam::Vec4;

use super::error::RelightingError;
use super::frame::Shot;
use super::scene::RelitScene;
use super::{Shape, pack};
use crate::passes::prt_gloss::{self, PrtGloss};
use crate::passes::prt_light::{self, PrtLight};
use crate::passes::prt_vertex::{self, PrtVertex};

/// Most triangles in a plan: CPU mirrors see visibility buffers as f32.
const MAX_TRIANGLES: u64 = (1 << 24) - 1;
/// Layers of a texture that every device has.
const MAX_LAYERS: u64 = 256;

/// A plan in the making.
pub(super) struct Builder {
    pub(super) plan: Plan,
    pub(super) shape: Shape,
}

/// From the sky to vertices.
pub(super) struct Lit {
    pub(super) sky: ResourceId,
    pub(super) rotation: ResourceId,
    light: ResourceId,
    pub(super) irradiance: ResourceId,
}

/// What the camera sees.
pub(super) struct Seen {
    pub(super) views: ResourceId,
    triangles: ResourceId,
    corners: ResourceId,
    visibility: ResourceId,
}

impl Builder {
    /// A buffer that keeps its contents. No buffer may be empty.
    fn filled<T: NoUninit + Zeroable>(&mut self, name: &str, contents: &[T]) -> ResourceId {
        let resource = if contents.is_empty() {
            Resource::buffer_with(name, &[T::zeroed()])
        } else {
            Resource::buffer_with(name, contents)
        };
        self.plan.add_resource(resource)
    }

    fn texture(&mut self, name: &str, format: TextureFormat) -> ResourceId {
        let Shape { size, samples, .. } = self.shape;
        self.plan.add_resource(Resource::texture(name, format, size.map(|side| side * samples)))
    }

    fn dispatch(&mut self, pass: &str, params: ParamsId, bindings: &[ResourceId], groups: [u32; 3]) {
        let pass = step(pass, params, bindings);
        self.plan.steps.push(Step::Dispatch { pass, groups });
    }

    fn decide(&mut self, pass: &str, kept: bool, reason: impl Into<String>) {
        let decision = Decision { pass: pass.into(), kept, reason: reason.into(), notes: Vec::new() };
        self.plan.decisions.push(decision);
    }

    /// Irradiance of all vertices, of the light of a frame.
    pub(super) fn light_vertices(
        &mut self,
        scene: &RelitScene<'_>,
        shot: &Shot<'_>,
    ) -> Result<Lit, RelightingError> {
        let Shape { bands, coefficients, functions, .. } = self.shape;
        let (harmonics, blocks) = (bands.coefficients() as u32, self.shape.light_blocks());
        let (sky, rotation) = (self.shape.packed_sky(shot.sky)?, self.shape.packed_rotation(shot.rotation)?);
        let (sky, rotation) = (self.filled("sky", &sky), self.filled("rotation", &rotation));
        let light_bytes = 16 * u64::from(harmonics * blocks);
        let light = self.plan.add_resource(Resource::buffer("light", light_bytes));
        let params = PrtLight { bands: bands.count() as u32, blocks, reserved0: 0, reserved1: 0 };
        let params = self.plan.add_params("prt_light", &params);
        let groups = (harmonics * blocks).div_ceil(prt_light::PER_GROUP);
        self.dispatch("prt_light", params, &[sky, rotation, light], [groups, 1, 1]);
        let reason = format!("{} bands, {coefficients} spectral coefficients", bands.count());
        self.decide("prt_light", true, reason);

        let vertices: usize = scene.transfer.vertices().iter().sum();
        let transfer = self.filled("transfer", &pack::transfer(&scene.transfer));
        let irradiance_bytes = 16 * vertices as u64 * u64::from(self.shape.blocks());
        let irradiance = self.plan.add_resource(Resource::buffer("irradiance", irradiance_bytes));
        let [groups_per_row, rows] = rows_of_groups(vertices, prt_vertex::PER_GROUP);
        let params = PrtVertex {
            vertices: vertices as u32,
            groups_per_row,
            harmonics,
            blocks,
            vertex_blocks: self.shape.blocks(),
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let params = self.plan.add_params("prt_vertex", &params);
        let groups = [groups_per_row, rows, functions as u32];
        self.dispatch("prt_vertex", params, &[transfer, light, irradiance], groups);
        let reason = match functions {
            1 => format!("{vertices} vertices, achromatic transfer"),
            _ => format!(
                "{vertices} vertices, {functions} functions of the wavelength: surfaces light each other"
            ),
        };
        self.decide("prt_vertex", true, reason);
        Ok(Lit { sky, rotation, light, irradiance })
    }

    /// Triangles, and which of them the camera sees.
    pub(super) fn look(&mut self, scene: &RelitScene<'_>, shot: &Shot<'_>) -> Result<Seen, RelightingError> {
        let count: usize = scene.surfaces.iter().map(|s| s.triangles().len()).sum();
        let unit = "triangles";
        fits("a visibility buffer".into(), count as u64, unit, MAX_TRIANGLES, "the number of triangles")?;
        let (triangles, corners) = pack::triangles(scene, &self.shape.space);
        let view = self.shape.view(shot.camera)?;
        let triangles = self.filled("triangles", &triangles);
        let corners = self.filled("corners", &corners);
        let views = self.filled("views", &[view]);
        let visibility = self.texture("visibility", TextureFormat::R32Uint);
        let depth = self.texture("depth", TextureFormat::Depth32Float);
        let params =
            Visibility { view: 0, first_triangle: 0, faces: VISIBILITY_ALL_FACES, from_distance: 0.0 };
        let params = self.plan.add_params("visibility", &params);
        // Depth too is farthest at 0.
        let cleared = |texture| Target { texture, mip: 0, layer: 0, load: Load::Clear([0.0; 4]) };
        self.plan.steps.push(Step::Draw {
            pass: step("visibility", params, &[triangles, views]),
            targets: Targets { color: vec![cleared(visibility)], depth: Some(cleared(depth)) },
            vertices: 3 * count as u32,
            instances: 1,
        });
        self.decide("visibility", true, format!("{count} triangles"));
        Ok(Seen { views, triangles, corners, visibility })
    }

    /// What vertices that shine send to the camera, if there are any.
    pub(super) fn shine(&mut self, scene: &RelitScene<'_>, lit: &Lit, seen: &Seen) {
        let Some(gloss) = scene.gloss else {
            self.decide("prt_gloss", false, "nothing shines");
            return;
        };
        let (points, lobes) = pack::gloss_points(scene.surfaces, gloss, &self.shape.space);
        let rows = gloss.rows();
        let matrices = pack::gloss_matrices(gloss);
        let [groups_per_row, group_rows] = rows_of_groups(points.len(), prt_gloss::PER_GROUP);
        let params = PrtGloss {
            vertices: points.len() as u32,
            groups_per_row,
            rows: rows as u32,
            camera_view: 0,
            bands: gloss.bands().count() as u32,
            blocks: self.shape.light_blocks(),
            vertex_blocks: self.shape.blocks(),
            reserved: 0,
        };
        let params = self.plan.add_params("prt_gloss", &params);
        let points = self.filled("gloss_points", &points);
        let matrices = self.filled("gloss_matrices", &matrices);
        let lobes = self.filled("gloss_lobes", &lobes);
        let bindings = [points, seen.views, matrices, lobes, lit.light, lit.irradiance];
        self.dispatch("prt_gloss", params, &bindings, [groups_per_row, group_rows, gloss.functions() as u32]);
        self.decide("prt_gloss", true, format!("{rows} vertices shine"));
    }

    /// The picture, and what its exposure is written to.
    pub(super) fn shade(
        &mut self,
        scene: &RelitScene<'_>,
        shot: &Shot<'_>,
        seen: &Seen,
        irradiance: ResourceId,
    ) -> Result<(ResourceId, ParamsId), RelightingError> {
        let (albedos, index_maps) = pack::albedos(scene);
        let palette: Vec<Vec4> = scene.palette.entries.iter().flat_map(pack::albedo).collect();
        let albedos = self.filled("albedos", &albedos);
        let index_maps = self.filled("index_maps", &index_maps);
        let palette = self.filled("palette", &palette);
        let [width, height] = self.shape.size;
        let pixels = u64::from(width) * u64::from(height);
        let picture = self.plan.add_resource(Resource::buffer("picture", 16 * pixels).readable());
        let params = self.shape.exposed(&shot.exposure)?;
        let params = self.plan.add_params("prt_shade", &params);
        let Seen { views, triangles, corners, visibility } = *seen;
        let mut bindings =
            vec![triangles, views, visibility, corners, irradiance, albedos, index_maps, palette, picture];
        let groups = [width.div_ceil(8), height.div_ceil(8), 1];
        let maps = scene.spectral_maps;
        let (kept, left_out, reason) = if maps.is_empty() {
            ("prt_shade", "prt_shade_maps", "all albedos are entries of the palette".to_owned())
        } else {
            bindings.push(self.spectral_maps(scene)?);
            ("prt_shade_maps", "prt_shade", format!("{} maps have a spectrum at every texel", maps.len()))
        };
        self.dispatch(kept, params, &bindings, groups);
        self.decide(kept, true, reason.clone());
        self.decide(left_out, false, reason);
        Ok((picture, params))
    }

    /// All spectral maps as layers of one texture.
    fn spectral_maps(&mut self, scene: &RelitScene<'_>) -> Result<ResourceId, RelightingError> {
        let maps = scene.spectral_maps;
        let layers = 3 * u64::from(self.shape.blocks()) * maps.len() as u64;
        fits("the spectral maps".into(), layers, "layers", MAX_LAYERS, "the number of maps")?;
        let texels: Vec<Vec4> = maps.iter().flat_map(pack::map_layers).collect();
        Ok(self.plan.add_resource(Resource {
            name: "spectral_maps".into(),
            kind: ResourceKind::Texture {
                format: TextureFormat::Rgba32Float,
                size: maps[0].size,
                layers: layers as u32,
                mips: 1,
            },
            lifetime: Lifetime::Persistent,
            initial: Some(bytemuck::cast_slice(&texels).to_vec()),
            readable: false,
        }))
    }

    pub(super) fn check_limits(&self, limits: &Limits) -> Result<(), RelightingError> {
        let mut total = 0;
        for resource in &self.plan.resources {
            let bytes = resource.kind.bytes();
            total += bytes;
            match resource.kind {
                ResourceKind::Buffer { .. } => {
                    let max = limits.max_storage_binding_bytes.min(limits.max_buffer_bytes);
                    let remedy = match resource.name.as_str() {
                        "picture" => "the picture's size",
                        "index_maps" => "the maps' sizes",
                        _ => "the number of vertices, bands or bounces",
                    };
                    fits(format!("buffer {}", resource.name), bytes, "bytes", max, remedy)?;
                }
                ResourceKind::Texture { size, .. } => {
                    let side = size[0].max(size[1]).into();
                    let (unit, max) = ("texels along a side", limits.max_texture_size.into());
                    fits(format!("texture {}", resource.name), side, unit, max, "the maps' sizes")?;
                }
                ResourceKind::Sampler { .. } => {}
            }
        }
        fits("the plan".into(), total, "bytes", limits.max_total_bytes, "the picture's and the maps' sizes")
    }
}

/// Groups in x and y, rows of at most as many as every device takes.
fn rows_of_groups(threads: usize, per_group: u32) -> [u32; 2] {
    let groups = (threads as u64).div_ceil(per_group.into());
    let per_row = groups.min(Limits::default().max_groups_per_dimension.into());
    [per_row as u32, groups.div_ceil(per_row) as u32]
}

/// A pass with its resources.
fn step(pass: &str, params: ParamsId, bindings: &[ResourceId]) -> PassStep {
    PassStep {
        pass: pass.into(),
        label: String::new(),
        params: Some(params),
        bindings: bindings.iter().copied().map(Into::into).collect(),
    }
}

pub(super) fn fits(
    what: String,
    needed: u64,
    unit: &'static str,
    max: u64,
    remedy: &'static str,
) -> Result<(), RelightingError> {
    if needed <= max { Ok(()) } else { Err(RelightingError::Limit { what, needed, unit, max, remedy }) }
}
