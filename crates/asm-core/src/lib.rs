//! Caustics of refractors in real time: a scene, settings and a device's limits become a plan that any executor runs.
//!
//! The methods are Shah, Konttinen & Pattanaik's caustics mapping, one photon per texel of the light's view and wavelength, and
//! what Wyman & Nichols (adaptive caustic maps) and Blanchette & Agu (adaptive spectral mapping) made of it, in compute passes
//! over visibility buffers; see [`passes`] for the passes and `shaders/` for their WGSL. The map holds XYZ in
//! 64-bit fixed point, so the same plan gives the same bits twice, and every photon's flux is accounted for.
//!
//! [`Method::Footprint`] is our own: cells of the light's view whose few wavelengths are traced through the scene's geometry, with
//! internal reflections and through several refractors, and laid down as a continuous function of place and wavelength.

mod bake;
mod bands;
mod bvh;
mod caustics;
mod decisions;
pub mod display;
mod emission;
mod error;
mod faces;
mod flicker;
mod footprint_work;
mod footprints;
mod gaps;
mod geometry;
mod glass_view;
mod lights;
mod map_fit;
pub mod moving;
pub mod passes;
mod photons;
mod planner;
mod price_list;
mod render;
mod renderer;
mod resources;
mod rungs;
mod settings;
pub mod shared;
mod space;
mod statistics;
mod update;
mod view_fit;

pub use bake::{BakePlan, bake_plan};
pub use error::PlanError;
pub use flicker::{Flicker, FlickerMeter};
pub use footprint_work::FootprintWork;
pub use passes::PASSES;
pub use planner::Planner;
pub use price_list::{Price, PriceList};
pub use render::{Picture, RenderPlan, render_plan};
pub use renderer::{AsmError, AsmRenderer, Updated};
pub use rungs::{Axes, LADDER, Rung, rungs};
pub use settings::{
    Emission, GapFilling, GlassView, Interfaces, LandingUpdate, MapFit, Method, Reflections, Refraction,
    RefractionRule, Settings, Splat,
};
pub use space::WorkingSpace;
pub use statistics::{GapEnergy, Ledger, LevelCount, LightStatistics, Statistics, Tally, ViewStatistics};
pub use update::UpdateError;
