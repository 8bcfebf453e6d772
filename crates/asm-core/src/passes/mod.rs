//! The passes: per stem a WGSL file in `shaders/` and here its parameters, bindings and CPU mirror.

use frame_plan::{Binding, BindingKind, PassSet};

pub mod coverage_mip;
pub mod deferred_refraction;
pub mod footprint_queue;
pub mod footprint_splat;
pub mod footprint_split;
pub mod gap_fill;
pub mod gap_mask;
pub mod gap_reach;
pub mod map_fit;
pub mod map_resolve;
pub mod path_trace;
pub mod photon_path;
pub mod photon_refine;
pub mod photon_trace;
pub mod receiver_bake;
pub mod shade;
pub mod uv_visibility;
pub mod visibility;

/// Every pass that plans of this crate name.
pub const PASSES: PassSet = PassSet(&[
    &visibility::VISIBILITY,
    &uv_visibility::UV_VISIBILITY,
    &coverage_mip::COVERAGE_MIP,
    &photon_refine::PHOTON_REFINE,
    &photon_trace::PHOTON_TRACE,
    &photon_path::PHOTON_PATH,
    &path_trace::PATH_TRACE,
    &footprint_split::FOOTPRINT_SPLIT,
    &footprint_queue::FOOTPRINT_QUEUE,
    &footprint_splat::FOOTPRINT_SPLAT,
    &map_fit::MAP_FIT,
    &gap_mask::GAP_MASK,
    &gap_reach::GAP_REACH,
    &gap_fill::GAP_FILL,
    &map_resolve::MAP_RESOLVE,
    &receiver_bake::RECEIVER_BAKE,
    &shade::SHADE,
    &deferred_refraction::DEFERRED_REFRACTION,
]);

const VIEW_WGSL: &str = include_str!("../../../../shaders/shared/view.wgsl");
const TRIANGLE_WGSL: &str = include_str!("../../../../shaders/shared/triangle.wgsl");
const REFRACT_WGSL: &str = include_str!("../../../../shaders/shared/refract.wgsl");
const OPTICS_WGSL: &str = include_str!("../../../../shaders/shared/optics.wgsl");
const SPLAT_WGSL: &str = include_str!("../../../../shaders/shared/splat.wgsl");
const SPLAT_TENT_WGSL: &str = include_str!("../../../../shaders/shared/splat_tent.wgsl");
const FLUX_WGSL: &str = include_str!("../../../../shaders/shared/flux.wgsl");
const LIGHT_VIEWS_WGSL: &str = include_str!("../../../../shaders/shared/light_views.wgsl");
const VISIBILITY_WGSL: &str = include_str!("../../../../shaders/shared/visibility.wgsl");
const PHOTON_QUEUE_WGSL: &str = include_str!("../../../../shaders/shared/photon_queue.wgsl");
const GAP_WGSL: &str = include_str!("../../../../shaders/shared/gap.wgsl");
const EMISSION_WGSL: &str = include_str!("../../../../shaders/shared/emission.wgsl");
const LIGHT_PATH_WGSL: &str = include_str!("../../../../shaders/shared/light_path.wgsl");
const PHOTONS_WGSL: &str = include_str!("../../../../shaders/shared/photons.wgsl");
const LANDING_SEARCH_WGSL: &str = include_str!("../../../../shaders/shared/landing_search.wgsl");
const BVH_WGSL: &str = include_str!("../../../../shaders/shared/bvh.wgsl");
const FOOTPRINT_WGSL: &str = include_str!("../../../../shaders/shared/footprint.wgsl");
const FOOTPRINT_CELLS_WGSL: &str = include_str!("../../../../shaders/shared/footprint_cells.wgsl");
const FOOTPRINT_LANDINGS_WGSL: &str = include_str!("../../../../shaders/shared/footprint_landings.wgsl");
const FOOTPRINT_LIGHT_WGSL: &str = include_str!("../../../../shaders/shared/footprint_light.wgsl");
const FOOTPRINT_WIDE_WGSL: &str = include_str!("../../../../shaders/shared/footprint_wide.wgsl");
const FOOTPRINT_BOOKS_WGSL: &str = include_str!("../../../../shaders/shared/footprint_books.wgsl");
const PATH_SPREAD_WGSL: &str = include_str!("../../../../shaders/shared/path_spread.wgsl");
const CROSSING_WGSL: &str = include_str!("../../../../shaders/shared/crossing.wgsl");
const EXIT_SEARCH_WGSL: &str = include_str!("../../../../shaders/shared/exit_search.wgsl");
const LEDGER_WGSL: &str = include_str!("../../../../shaders/shared/ledger.wgsl");
const IRRADIANCE_WGSL: &str = include_str!("../../../../shaders/shared/irradiance.wgsl");

const VISIBILITY_TEXTURE: BindingKind = BindingKind::Texture { uint: true, filter: false, array: false };
const VISIBILITY_TEXTURE_ARRAY: BindingKind = BindingKind::Texture { uint: true, filter: false, array: true };

const fn binding(name: &'static str, kind: BindingKind) -> Binding {
    Binding { name, kind }
}
