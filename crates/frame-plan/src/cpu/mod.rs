//! The CPU executor: runs the mirrors.

mod clip;
mod executor;
mod mirror;
mod raster;
mod step;
mod storage;
mod texture;

pub use executor::CpuExecutor;
pub use mirror::{Fragment, MirrorArgs, VertexOutput};
pub use texture::{StorageRow, StorageTextureMut, TextureView};
