//! Relighting as a plan: what [`crate::Sky`] shows in f64, as passes for every executor, in f32.
//!
//! ```text
//! sky, rotation --prt_light--> light --prt_vertex, prt_gloss--> irradiance of vertices --+
//! triangles, camera --visibility--> what is seen ----------------------------------------+--prt_shade or prt_shade_maps--> picture
//! ```
//!
//! A plan is made once, for surfaces, their transfer and their albedos. A frame replaces a few hundred numbers: the sky,
//! its rotation, the camera, the exposure. The picture is XYZ.

mod albedo;
mod build;
mod error;
mod frame;
mod pack;
mod scene;
mod texture;

use asm_core::WorkingSpace;
use frame_plan::{Limits, ParamsId, Plan, ResourceId};

use crate::bands::Bands;
use crate::gloss::GlossTransfer;
use build::{Builder, fits};

pub use albedo::{Albedo, AlbedoTerms, IndexMap, Palette, Projection, SpectralMap};
pub use error::RelightingError;
pub use frame::{Exposure, Shot};
pub use scene::{RelitScene, SceneTransfer};
pub use texture::RoundTrip;

/// The picture of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RelightingSettings {
    /// Pixels in x and y.
    pub size: [u32; 2],
    /// Samples per pixel and axis, 1 or more.
    pub samples: u32,
}

/// Surfaces, their transfer and their albedos as frames under any light. See [`RelitScene`] for what goes in and [`Shot`]
/// for what frames may change.
#[derive(Clone, Debug)]
pub struct Relighting {
    /// For [`frame_plan::Executor::prepare`], with [`crate::PASSES`]. It starts with the shot that it was made with.
    pub plan: Plan,
    shape: Shape,
    ids: Ids,
}

/// What is the same in all frames.
#[derive(Clone, Copy, Debug)]
struct Shape {
    size: [u32; 2],
    samples: u32,
    bands: Bands,
    /// Of lights.
    coefficients: usize,
    /// Of transfer.
    functions: usize,
    /// Of gloss; none where nothing shines.
    gloss_functions: usize,
    space: WorkingSpace,
}

/// What frames write and read.
#[derive(Clone, Copy, Debug)]
struct Ids {
    sky: ResourceId,
    rotation: ResourceId,
    views: ResourceId,
    picture: ResourceId,
    shade: ParamsId,
}

impl Relighting {
    /// The plan of a scene, whose first frame is `shot`.
    ///
    /// # Errors
    /// [`RelightingError`] for what does not fit together or into `limits`, before anything is allocated on a device.
    pub fn new(
        scene: &RelitScene<'_>,
        shot: &Shot<'_>,
        settings: &RelightingSettings,
        limits: &Limits,
    ) -> Result<Self, RelightingError> {
        scene.check()?;
        let RelightingSettings { size, samples } = *settings;
        for (what, got) in [("the picture's width", size[0]), ("its height", size[1]), ("samples", samples)] {
            if got == 0 {
                return Err(RelightingError::Value { what, got: 0.0, expected: "1 or more" });
            }
        }
        let texels = u64::from(size[0].max(size[1])) * u64::from(samples);
        let unit = "texels along a side";
        fits("the view".into(), texels, unit, limits.max_texture_size.into(), "the picture's size")?;
        let shape = Shape {
            size,
            samples,
            bands: scene.transfer.bands(),
            coefficients: scene.coefficients(),
            functions: scene.transfer.functions(),
            gloss_functions: scene.gloss.map_or(0, GlossTransfer::functions),
            space: pack::space(scene.surfaces),
        };
        let mut builder = Builder { plan: Plan { name: "relighting".into(), ..Plan::default() }, shape };
        let lit = builder.light_vertices(scene, shot)?;
        let seen = builder.look(scene, shot)?;
        builder.shine(scene, &lit, &seen);
        let (picture, shade) = builder.shade(scene, shot, &seen, lit.irradiance)?;
        builder.check_limits(limits)?;
        let ids = Ids { sky: lit.sky, rotation: lit.rotation, views: seen.views, picture, shade };
        Ok(Self { plan: builder.plan, shape, ids })
    }
}

impl Shape {
    /// Blocks of four coefficients of a light.
    fn light_blocks(&self) -> u32 {
        pack::blocks(self.coefficients) as u32
    }

    /// Blocks of all functions of transfer, and of gloss.
    fn blocks(&self) -> u32 {
        (self.functions + self.gloss_functions) as u32 * self.light_blocks()
    }
}
