//! The oracle: f64 light tracing and eye rays through exact meshes.
//!
//! It shares nothing with the render passes: own Snell and Fresnel, own intersections, own sampling. What it does
//! share are the definitions: the [`Scene`](spectral_scene::Scene), the spectra of lights and colours, the dispersion
//! formulas of `spectral-core`. [`bake`] gives the irradiance on one receiver, [`render`] a camera picture.
//!
//! # Light
//!
//! Every light sends paths at the bounds of every refractor and every mirror: parallel beams through the smallest
//! rectangle round its shadow, point and spot lights through a cone. A path carries wavelengths from 380 to 780 nm,
//! stratified, where the eye sees them. What meets neither is left to shadow rays from the receiver. A light's `range_m`
//! cuts: beyond it, measured to the first glass, mirror or receiver, there is nothing.
//!
//! Sampling is by Owen-scrambled Sobol points in four independent replicates, whose spread is the standard error.
//! At an interface the reflected and the refracted part both go on; where one is weak, chance decides whether it goes on
//! stronger or leaves its power to the other.
//!
//! # Glass
//!
//! * Both parts carry their unpolarised Fresnel share at the shading normal, the interpolated one on smooth meshes.
//!   Flux is that of the geometric facet. A direction that leaves on the wrong side of its facet is lost, and counted.
//! * `bounces` counts reflections inside glass in a row; light that leaves and enters again, the same body or another,
//!   starts anew. Light that was reflected outside and then enters counts as refracted.
//! * Inside, light is attenuated by Beer and Lambert's law with the upsampled `attenuation.color`. A surface lets pass
//!   `transmission` times `base_color` of what is refracted, at each passage.
//! * Where refractors overlap, the one entered last fills the overlap. Where their surfaces coincide they are in
//!   optical contact. A glass that touches an opaque surface is left before the light lands.
//! * An open mesh is one interface: light that has entered stays inside until it lands or meets the mesh again from
//!   behind. [`GeometryCounts`] says what becomes of bad meshes.
//! * Roughness, iridescence and `thickness_m` are ignored.
//!
//! # Mirrors
//!
//! * Polished metal ([`spectral_scene::Material::is_mirror`]) reflects on both sides, at the shading normal, by Schlick's
//!   formula with the upsampled `base_color`, and absorbs the rest. Nothing lands on it.
//! * The first reflection of light that has met nothing is always followed, further ones up to `bounces`, counted
//!   together with outside reflections at glass. A mirror inside or behind glass leaves light what it is, refracted.
//!
//! # Matt objects
//!
//! They block and absorb, on both sides, before and behind glass and mirrors; rough metal is one of them. Nothing is
//! reflected from one to another.
//!
//! # Accounts
//!
//! Each bake has a [`Ledger`]: per 10 nm, what was sent and where it went, equal to rounding.
//!
//! The same seed gives the same bits on any number of threads.

mod aim;
mod bake;
mod direct;
mod error;
mod film;
mod lamp;
mod ledger;
mod medium;
mod mirror;
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
