//! Each light of a plan: its wavelengths, its views and what it needs.

use std::ops::Range;

use glam::{DVec3, UVec2, Vec3};
use spectral_core::upsample::SmoothSpectrum;
use spectral_scene::{Effects, LightShape, Scene};

use crate::bands::{Glass, LightBands, one_wavelength};
use crate::caustics::guard_texels;
use crate::emission::Refinement;
use crate::geometry::{Geometry, bounds};
use crate::shared::flux::QUANTUM;
use crate::shared::triangle::{TRIANGLE_MIRROR, TRIANGLE_REFRACTS, Triangle};
use crate::shared::view::View;
use crate::statistics::LightBooks;
use crate::view_fit::{Grid, Source, fit, fit_one, texture_view};
use crate::{
    GapFilling, Interfaces, MapFit, Method, PlanError, Reflections, Refraction, Settings, WorkingSpace,
};

/// Largest number of photons of a light: 2^30 units each, added up in 64 bits.
const MAX_PHOTONS: u64 = 1 << 34;

/// Everything in working units lies within this of the origin.
pub(crate) const REACH: f64 = 1.0;

/// What a plan is for.
pub(crate) struct Purpose {
    pub(crate) name: String,
    pub(crate) receivers: Receivers,
    pub(crate) map_size: u32,
    /// How much finer a map the result still resolves.
    pub(crate) most_zoom: f64,
    /// Texels of a bake: where light may land is then seen as the receiver's texture sees it, if it can be.
    pub(crate) texels: Option<UVec2>,
    /// A view besides the lights', which becomes the last in `views`.
    pub(crate) camera: Option<View>,
}

/// Where light may land, and what for.
#[derive(Clone, Copy)]
pub(crate) enum Receivers {
    /// The object to bake onto.
    Object(usize),
    /// All opaque objects.
    Opaque,
}

/// Least texels along each side of the view that shows what the glass shades.
const LEAST_SILHOUETTE: u32 = 512;

/// Texels along each side of the view that shows what the glass shades.
pub(crate) fn silhouette_size(settings: &Settings) -> u32 {
    match settings.method {
        Method::Footprint => settings.emission_size.max(LEAST_SILHOUETTE),
        _ => settings.emission_size,
    }
}

/// One light, ready to be turned into steps.
pub(crate) struct LightSetup {
    pub(crate) name: String,
    pub(crate) index: usize,
    pub(crate) source: Source,
    pub(crate) bands: LightBands,
    /// First row in `bands` and `optics`.
    pub(crate) first_band: u32,
    /// First row of refracted light in the ledger.
    pub(crate) first_ledger: u32,
    /// In `views`: emission if there are photons, then landing, then the map's if they are others.
    pub(crate) views: Range<u32>,
    /// First view of where light may land; each is a face of the map.
    pub(crate) landing_view: u32,
    /// Number of those views.
    pub(crate) faces: u32,
    /// First of as many views of the map: the landing views, or such that the device fits.
    pub(crate) map_view: u32,
    /// View of the casters that shows what they shade: the emission view, but for footprints, whose cells are few.
    pub(crate) silhouette_view: u32,
    /// What the receiver's texture sees, where that is the landing view.
    pub(crate) receiver_view: Option<View>,
    /// First view that shadows are sought in.
    pub(crate) direct_view: u32,
    /// Number of those views.
    pub(crate) direct_faces: u32,
    /// There are photons.
    pub(crate) caustic: bool,
    /// Photons that go into glass.
    pub(crate) refracted: bool,
    /// `TRIANGLE_*` of the surfaces that other photons are thrown back from; 0 where there are none.
    pub(crate) reflecting: u32,
    /// Glass has back faces that light may leave by.
    pub(crate) exits: bool,
    /// Gaps between wavelengths are filled.
    pub(crate) gaps: bool,
    /// Where refracted light lands misses matt surfaces before the glass.
    pub(crate) cut: bool,
    /// Where light lands misses opaque surfaces that shadows need.
    pub(crate) separate_direct: bool,
    pub(crate) shadows: bool,
    pub(crate) landing_from: f64,
    /// Middle of the bounds of the receivers behind the front of the glass.
    pub(crate) landing_center: Vec3,
    /// Middle of the bounds of all receivers.
    pub(crate) reflected_center: Vec3,
    pub(crate) spot_axis: Vec3,
    pub(crate) spot_scale: f32,
    pub(crate) spot_offset: f32,
    pub(crate) range: f32,
}

/// Area across the light, or solid angle in the middle, of a view's texel.
pub(crate) fn texel_extent(view: &View) -> f64 {
    f64::from(view.texel_slope.x) * f64::from(view.texel_slope.y)
}

impl LightSetup {
    /// The map has views of its own.
    pub(crate) fn fits_map(&self) -> bool {
        self.map_view != self.landing_view
    }

    /// `wavelengths` are those of all lights.
    pub(crate) fn books(
        &self,
        space: &WorkingSpace,
        emission: &View,
        refinement: Option<&Refinement>,
        wavelengths: u32,
    ) -> LightBooks {
        let area = match self.source {
            Source::Parallel(_) => space.metres_per_unit * space.metres_per_unit,
            Source::Eye(_) => 1.0,
        };
        let extent = texel_extent(emission) * area / f64::from(QUANTUM);
        LightBooks {
            name: self.name.clone(),
            refracted_row: self.refracted.then_some(self.first_ledger),
            reflected_row: (self.reflecting != 0)
                .then_some(self.first_ledger + if self.refracted { wavelengths } else { 0 }),
            wavelengths_nm: self.bands.wavelengths_nm.clone(),
            lumens_per_unit: self.bands.lumens_per_unit(extent),
            levels: refinement.map_or(0, |r| r.levels()),
            coarsest_cells: refinement.map_or(0, |r| r.coarsest_cells()),
            lumens_per_map_unit: self.gaps.then_some(self.bands.largest * extent),
            footprints: None,
        }
    }
}

/// The lights that shine, and their views.
pub(crate) fn light_setups(
    scene: &Scene,
    settings: &Settings,
    effects: &Effects,
    space: &WorkingSpace,
    geometry: &Geometry,
    purpose: &Purpose,
    glasses: &[Glass<'_>],
) -> Result<(Vec<LightSetup>, Vec<View>), PlanError> {
    let count = scene.lights.len();
    let chosen = settings.lights.clone().unwrap_or_else(|| (0..count).collect());
    if let Some(&index) = chosen.iter().find(|&&i| i >= count) {
        return Err(PlanError::NoSuch { what: "light", index, count });
    }
    let one = settings.prune && one_wavelength(scene, effects);
    let has_glass = geometry.triangles.len() > geometry.opaque as usize;
    let has_mirrors = geometry.opaque > geometry.matt;
    let refracted = !settings.prune || (has_glass && geometry.matt > 0 && effects.caustics.on);
    let reflecting = reflecting(settings, effects, geometry);
    let caustic = refracted || reflecting != 0;
    let casters = if refracted { TRIANGLE_REFRACTS | reflecting } else { reflecting };
    // A bake holds what arrives, a picture what is reflected.
    let reflectances: Vec<SmoothSpectrum> = match purpose.receivers {
        Receivers::Object(_) => vec![SmoothSpectrum::ONE; scene.materials.len()],
        Receivers::Opaque => glasses.iter().map(Glass::reflectance).collect(),
    };
    let (mut setups, mut views) = (Vec::new(), Vec::new());
    let (mut first_band, mut first_ledger) = (0, 0);
    let receiver_view = match (purpose.receivers, purpose.texels) {
        (Receivers::Object(object), Some(texels)) => texture_view(geometry, object, texels, REACH),
        _ => None,
    };
    // Cells have all glass within them: none is cut by the view's edge.
    let emission_guard = u32::from(settings.method == Method::Footprint);
    for index in chosen {
        let light = &scene.lights[index];
        let bands = LightBands::new(light, settings, one, &reflectances)?;
        if bands.largest <= 0.0 {
            continue;
        }
        let source = Source::of(light, space)?;
        let first_view = views.len() as u32;
        let emission_size = UVec2::splat(settings.emission_size);
        if caustic {
            let corners = geometry.flagged_corners(casters);
            views.push(fit_one(
                source,
                corners,
                Grid::of(emission_size, emission_guard),
                REACH,
                &light.name,
            )?);
        }
        let silhouette_view = if caustic && settings.method == Method::Footprint {
            let corners = geometry.flagged_corners(casters);
            let grid = Grid::of(UVec2::splat(silhouette_size(settings)), 0);
            views.push(fit_one(source, corners, grid, REACH, &light.name)?);
            first_view + 1
        } else {
            first_view
        };
        let landing_from = source.nearest(geometry.refractor_corners(), REACH);
        let landing_from = if landing_from.is_finite() { landing_from } else { 0.0 };
        let map = Grid::of(UVec2::splat(purpose.map_size), guard_texels(settings, purpose.map_size));
        let direct_view = views.len() as u32;
        let direct = match purpose.receivers {
            Receivers::Object(object) => fit(source, geometry.object_corners(object), map, REACH),
            Receivers::Opaque => fit(source, geometry.matt_corners(), map, REACH),
        };
        let direct_faces = direct.len() as u32;
        views.extend(&direct);
        let receiver_view = receiver_view.filter(|_| caustic);
        let (landing_view, landing) = match receiver_view {
            Some(view) => (views.len() as u32, vec![view]),
            None => (direct_view, direct),
        };
        let faces = landing.len() as u32;
        views.extend(receiver_view);
        let finer = receiver_view.is_none()
            && settings.map_fit() == MapFit::Landings
            && (purpose.most_zoom > 1.0 || !settings.prune);
        let map_view = if refracted && finer {
            let map_view = views.len() as u32;
            views.extend(&landing);
            map_view
        } else {
            landing_view
        };
        let photons = u64::from(settings.emission_size).pow(2) * bands.wavelengths_nm.len() as u64;
        let split = effects.dispersion.on && bands.wavelengths_nm.len() > 1;
        let gaps = refracted && settings.gap_filling() != GapFilling::None && (split || !settings.prune);
        // The paper's rules add up one texel as often as there are samples.
        let max = if gaps { MAX_PHOTONS / u64::from(settings.gap_samples) } else { MAX_PHOTONS };
        if caustic && photons > max {
            return Err(PlanError::TooManyPhotons {
                texels: u64::from(settings.emission_size).pow(2),
                wavelengths: bands.wavelengths_nm.len() as u64,
                max,
            });
        }
        let cut = refracted
            && receiver_view.is_none()
            && (!settings.prune || source.nearest(geometry.matt_corners(), REACH) < landing_from);
        let (spot_axis, spot_scale, spot_offset, range_m) = cone(&light.shape);
        let (rows, wavelengths) = (bands.rows(), bands.wavelengths_nm.len() as u32);
        setups.push(LightSetup {
            name: light.name.clone(),
            index,
            source,
            bands,
            first_band,
            first_ledger,
            views: first_view..views.len() as u32,
            landing_view,
            faces,
            map_view,
            silhouette_view,
            receiver_view,
            direct_view,
            direct_faces,
            caustic,
            refracted,
            reflecting,
            gaps,
            exits: refracted
                && settings.refraction() == Refraction::ImageSpace
                && settings.interfaces == Interfaces::Two
                && (!settings.prune || faces_away(source, &geometry.triangles[geometry.opaque as usize..])),
            cut,
            separate_direct: caustic && (cut || has_mirrors || receiver_view.is_some()),
            shadows: effects.shadows.on || !settings.prune,
            landing_from,
            landing_center: landing_center(source, geometry, purpose.receivers, landing_from),
            reflected_center: landing_center(source, geometry, purpose.receivers, 0.0),
            spot_axis: spot_axis.as_vec3(),
            spot_scale: spot_scale as f32,
            spot_offset: spot_offset as f32,
            range: range_m.map_or(0.0, |range_m| range_m / space.metres_per_unit) as f32,
        });
        first_band += rows;
        first_ledger += wavelengths;
    }
    Ok((setups, views))
}

/// `TRIANGLE_*` of the surfaces that light is thrown back from.
fn reflecting(settings: &Settings, effects: &Effects, geometry: &Geometry) -> u32 {
    let (mirrors, outsides) = match settings.reflections {
        Reflections::None => (false, false),
        Reflections::Mirrors => (true, false),
        Reflections::All => (true, true),
    };
    let lands = geometry.matt > 0;
    let has_mirrors = geometry.opaque > geometry.matt && lands && effects.reflective_caustics.on;
    let has_glass = geometry.triangles.len() > geometry.opaque as usize && lands && effects.caustics.on;
    let kept = |asked: bool, called_for: bool, flag: u32| {
        if asked && (called_for || !settings.prune) { flag } else { 0 }
    };
    kept(mirrors, has_mirrors, TRIANGLE_MIRROR)
        | kept(outsides, has_glass && effects.reflection.on, TRIANGLE_REFRACTS)
}

fn landing_center(source: Source, geometry: &Geometry, receivers: Receivers, landing_from: f64) -> Vec3 {
    let (low, high) = match receivers {
        Receivers::Object(object) => bounds(geometry.object_corners(object)),
        Receivers::Opaque => bounds(
            geometry.matt_corners().filter(|&p| source.nearest(std::iter::once(p), REACH) >= landing_from),
        ),
    }
    .unwrap_or_default();
    (0.5 * (low + high)).as_vec3()
}

/// Some triangle shows its back to the light.
fn faces_away(source: Source, triangles: &[Triangle]) -> bool {
    triangles.iter().any(|t| {
        let n = t.scaled_normal().as_dvec3();
        match source {
            Source::Parallel(direction) => direction.dot(n) > 0.0,
            Source::Eye(eye) => (t.p0.as_dvec3() - eye).dot(n) > 0.0,
        }
    })
}

/// Axis, scale and offset of a spot's falloff (KHR_lights_punctual), and the range. Other lights have a cone that is 1 everywhere.
fn cone(shape: &LightShape) -> (DVec3, f64, f64, Option<f64>) {
    match *shape {
        LightShape::Directional { direction } => (direction.normalize(), 0.0, 1.0, None),
        LightShape::Point { range_m, .. } => (DVec3::NEG_Z, 0.0, 1.0, range_m),
        LightShape::Spot { direction, inner_cone_rad, outer_cone_rad, range_m, .. } => {
            let scale = 1.0 / (inner_cone_rad.cos() - outer_cone_rad.cos()).max(0.001);
            (direction.normalize(), scale, -outer_cone_rad.cos() * scale, range_m)
        }
    }
}
