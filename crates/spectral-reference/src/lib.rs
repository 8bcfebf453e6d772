//! The oracle: f64 light tracing and eye rays through exact meshes.
//!
//! It shares nothing with the render passes: own Snell and Fresnel, own intersections, own sampling. What it does
//! share are the definitions: the [`Scene`](spectral_scene::Scene), the spectra of lights and colours, the dispersion
//! formulas of `spectral-core`.

mod bake;
mod direct;
mod error;
mod film;
mod lamp;
mod ledger;
mod medium;
mod optics;
mod render;
mod shade;
mod shoot;
mod sobol;
mod spectrum;
mod texels;
mod trace;
mod tree;
mod triangle;
mod world;

pub use bake::{Bake, BakeSettings, Effort, StandardError, bake};
pub use error::ReferenceError;
pub use ledger::{Ledger, LedgerBin, PathCounts};
pub use render::{Picture, RenderSettings, render};
pub use world::GeometryCounts;
