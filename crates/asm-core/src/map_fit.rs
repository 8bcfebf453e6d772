//! Fitting a map to where light lands: the steps from a part of the photons to the map's views.

use frame_plan::{Bound, ResourceId, Step};
use glam::{DVec2, UVec2};

use crate::caustics::{Caustics, guard_texels};
use crate::lights::LightSetup;
use crate::passes::map_fit::MapFit;
use crate::photons::Tracer;
use crate::resources::Resources;
use crate::shared::photons::{BOUNDS_WORDS, EMISSION_SAMPLE, Photons};
use crate::{PlanError, Splat};

/// Cells along each side of a landing view, which the map's views are snapped to.
const CELLS: u32 = 64;

/// Cells beyond the outermost that hold a landing: other photons may land a little farther out.
const MARGIN: u32 = 1;

/// Photons along each side of the emission view that tell where light lands, at least.
const SAMPLES: u32 = 128;

/// Of how many texels along each side at most one is traced, with many wavelengths and with few: every wavelength takes
/// another one.
const MOST_STRIDE: u32 = 4;
const MOST_STRIDE_OF_FEW: u32 = 2;
const FEW_WAVELENGTHS: u32 = 3;

/// Most bytes of the bounds of landings: a map has up to six faces.
const BOUNDS_BYTES: u64 = 4 * 6 * BOUNDS_WORDS as u64;

/// A buffer for the bounds of landings, where a light's map is fitted to them.
pub(crate) fn bounds_buffer(
    resources: &mut Resources<'_>,
    setups: &[LightSetup],
) -> Result<Option<ResourceId>, PlanError> {
    if !setups.iter().any(LightSetup::fits_map) {
        return Ok(None);
    }
    resources.buffer("landing bounds", BOUNDS_BYTES, "lights").map(Some)
}

/// Texels of the map between photons that nothing bends, up to which their splats still overlap.
fn widest_spacing(splat: Splat) -> f64 {
    match splat {
        Splat::Point => 0.5,
        Splat::Gaussian { radius } => 0.8 * f64::from(radius),
        Splat::Auto => 4.0,
    }
}

/// A light's photons, as they go into its map.
pub(crate) struct FittedPhotons {
    pub(crate) tracer: Tracer,
    pub(crate) photons: Photons,
    pub(crate) wavelengths: u32,
    /// What shows where they land.
    pub(crate) landing: ResourceId,
    /// Texels along a side.
    pub(crate) map_size: u32,
}

impl Caustics<'_> {
    /// Steps that write the map's views.
    pub(crate) fn fit_map(
        &mut self,
        bounds: ResourceId,
        label: &str,
        fitted: &FittedPhotons,
    ) -> Result<(), PlanError> {
        let (photons, size) = (fitted.photons, fitted.map_size as f32);
        let emission_size = self.settings.emission_size;
        let few = fitted.wavelengths <= FEW_WAVELENGTHS;
        let most = if few { MOST_STRIDE_OF_FEW } else { MOST_STRIDE };
        let stride = (emission_size / SAMPLES).clamp(1, most);
        let sample = Photons {
            emission: EMISSION_SAMPLE,
            map_view: photons.landing_view,
            sample_stride: stride,
            ..photons
        };
        let groups = [emission_size.div_ceil(stride); 2];
        let groups = self.resources.groups(groups, fitted.wavelengths, "emission_size")?;
        self.resources.plan.steps.push(Step::ClearBuffer { buffer: bounds });
        let label_of_sample = format!("{label}, landings");
        let pass = self.trace_step(&label_of_sample, &fitted.tracer, sample, fitted.landing, bounds);
        self.resources.plan.steps.push(Step::Dispatch { pass, groups });

        let spacing = photons.splat_spacing.as_dvec2();
        let zoom = (widest_spacing(self.settings.splat) / spacing).min(DVec2::splat(self.most_zoom));
        self.fit_views(
            bounds,
            label,
            [photons.landing_view, photons.map_view, photons.landing_faces],
            zoom,
            size,
        );
        Ok(())
    }

    /// The step that writes a map's views, from the bounds of landings: first landing view, first view of the map, number of each;
    /// at most `zoom` times as fine.
    pub(crate) fn fit_views(
        &mut self,
        bounds: ResourceId,
        label: &str,
        views: [u32; 3],
        zoom: DVec2,
        size: f32,
    ) {
        let [landing_view, map_view, faces] = views;
        let least = (f64::from(CELLS) / zoom).ceil().clamp(DVec2::ONE, DVec2::splat(CELLS.into()));
        let guard = guard_texels(self.settings, size as u32) as f32;
        let fit = MapFit {
            landing_view,
            map_view,
            faces,
            cells: CELLS,
            least: UVec2::new(least.x as u32, least.y as u32),
            margin: MARGIN,
            spread: size / (size - 2.0 * guard).max(0.5 * size),
        };
        let bindings = [bounds, self.views].map(Bound::from).to_vec();
        self.dispatch("map_fit", label, &fit, bindings, [1, 1, 1]);
    }
}
