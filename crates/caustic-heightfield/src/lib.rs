//! Refractive caustics under a height field: the pond of Trendall & Stewart, *General calculations using graphics
//! hardware, with application to interactive caustics* (Rendering Techniques 2000).
//!
//! ```text
//! x, y       metres, from the corner of sample (0, 0); sample (i, j) lies at ((i + 1/2) dx, (j + 1/2) dy)
//! z          metres, upwards from the water at rest; the surface is z = h(x, y), the floor z = -d
//! L_i, L_t   unit directions of travel of the light above and below the surface; their z is negative
//! ```
//!
//! Every grid is row-major, x fastest.

pub mod adjusted;
mod convolution;
mod convolve;
mod dispersion;
mod distance_table;
mod error;
mod exact;
mod exr_heights;
mod floor;
mod height_field;
mod impulse;
mod lobe;
mod lobe_sum;
mod low_rank;
mod normals;
pub mod passes;
mod photon;
mod plan;
mod pond;
mod refraction_table;
mod scene;
mod shadow;
mod six_passes;
mod splat;
mod supersample;
mod surface_light;
mod walls;
mod wave_equation;

pub use convolution::{Convolution, ConvolutionSettings, ConvolutionSources};
pub use convolve::{Convolve, Sample};
pub use dispersion::{Bands, FloorColor, SEEN_NM, Spread, VISIBLE_TEXELS, ior_below_at};
pub use distance_table::{DistanceTable, heights_by_table};
pub use error::PondError;
pub use exact::exact;
pub use floor::{FloorGrid, FloorLight, FloorReport, relative_rms};
pub use height_field::HeightField;
pub use impulse::{Impulse, Ripple, impulse_heights};
pub use lobe::downward_share;
pub use lobe_sum::{LobeReport, LobeSum, LobeWay};
pub use low_rank::{LowRank, LowRankFloor, LowRankReport, LowRankSettings};
pub use passes::PASSES;
#[cfg(feature = "spirv")]
pub use passes::SPIRV_PASSES;
pub use photon::{Photon, PhotonFloor, PhotonPlan, PhotonSettings, water_dispersion};
pub use plan::{HeightSource, PlanSettings, PondFrame, PondPlan, Room};
pub use pond::{Form, Illumination, Normals, Outside, Pond, light_tilted_deg};
pub use scene::{Moment, Pebble, PondScene, Surface, Swell, Wave, numbered_name};
pub use six_passes::{Accumulation, SixPassFloor, SixPassReport, SixPassSettings, SixPasses};
pub use splat::Splat;
pub use supersample::exact_over_facets;
pub use surface_light::{SurfaceLight, SurfaceReport};
pub use walls::{WallImages, wall_images};
pub use wave_equation::{Walls, WaveEquation};
