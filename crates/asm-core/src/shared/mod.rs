//! Host side of `shaders/shared/`: one module per file, the same structs and functions in the same order.

pub mod bvh;
pub mod crossing;
pub mod emission;
pub mod exit_search;
pub mod flux;
pub mod footprint;
pub mod footprint_books;
pub mod footprint_cells;
pub mod footprint_landings;
pub mod footprint_light;
pub mod footprint_wide;
pub mod gap;
pub mod irradiance;
pub mod landing_search;
pub mod ledger;
pub mod light_path;
pub mod light_views;
pub mod optics;
pub mod path_spread;
pub mod photon_queue;
pub mod photons;
pub mod refract;
pub mod splat;
pub mod splat_tent;
pub mod triangle;
pub mod view;
