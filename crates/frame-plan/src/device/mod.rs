//! What executors on devices share: everything about plans that is the same through every API.

mod import;
mod params;
mod uses;
mod writes;

pub use import::{ImportShape, import_problem};
pub use params::ParamsLayout;
pub use uses::{Float32, Uses};
pub use writes::{Write, Writes};
