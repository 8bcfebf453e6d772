//! Spectral precomputed radiance transfer (Schwenk et al. 2010): matt objects under distant spectral light.
//!
//! Light from far away is a function of direction and wavelength, L(omega, lambda). Directions are represented by real
//! [spherical harmonics](sh), wavelengths by a [basis](spectral_core::basis). What a vertex makes of the light is its
//! [transfer](Transfer), which knows no wavelength:
//!
//! ```text
//! T_k = integral of V(omega) max(n . omega, 0) Y_k(omega) d omega        (eq. 4 of the paper)
//! E(lambda) = sum_k T_k L_k(lambda)                                      irradiance
//! ```
//!
//! so light, its spectrum and its orientation may change at any time without a new transfer. V is 0 where the scene
//! itself blocks the direction. [`precompute`] finds T by rays on all cores, [`cache`] keeps it on disk.
//!
//! A [`SpectralSky`] is such light at every wavelength, from spectra, a [`Panorama`] or a [`SpectralPanorama`]; a [`Sky`] is the same in
//! the coefficients of a basis, and shows surfaces by their transfer.
//! Light that surfaces throw on each other has their colours: [`add_bounces`] makes the transfer spectral, as far as it is. Surfaces that
//! shine have a lobe about the mirrored view: [`GlossTransfer`].
//!
//! [`Relighting`] makes a plan of it that every executor runs: see [`passes`].
//!
//! Directions are unit vectors in the world's right-handed space, from the surface towards the light.

mod bands;
mod bounces;
pub mod cache;
pub mod cosine_lobe;
mod cosine_power;
mod equirectangular;
mod error;
pub mod figures;
mod gloss;
mod hemisphere;
pub mod metamer;
mod occlusion;
mod panorama;
pub mod passes;
mod reflected;
mod relighting;
mod resampling;
pub mod sh;
pub mod shared;
mod sky;
mod spectral_panorama;
mod spectral_sky;
mod surface;
mod transfer;
mod upsampled;

pub use bands::{Bands, BandsError};
pub use bounces::{BounceSettings, SpectralTransfer, add_bounces};
pub use error::{PrtError, SurfaceError};
pub use gloss::{GlossTransfer, PhongLobe};
pub use panorama::{Panorama, PanoramaError};
pub use passes::PASSES;
#[cfg(feature = "spirv")]
pub use passes::SPIRV_PASSES;
pub use relighting::{
    Albedo, AlbedoTerms, Exposure, IndexMap, Palette, Projection, Relighting, RelightingError,
    RelightingSettings, RelitScene, RoundTrip, SceneTransfer, Shot, SpectralMap,
};
pub use resampling::{Resampling, WavelengthsError};
pub use sky::Sky;
pub use spectral_panorama::{SpectralPanorama, SpectralPanoramaError};
pub use spectral_sky::{ShapeError, SpectralSky, shape_of_bands};
pub use surface::Surface;
pub use transfer::{Transfer, TransferSettings, precompute};
