//! The steps of photons: from a light's emission view through glass, or back from mirrors, into its map.

use frame_plan::{Bound, PassStep, ResourceId, Step};

use crate::caustics::{Caustics, guard_texels};
use crate::emission::{EmissionView, QUEUE_ARGUMENTS_BYTES};
use crate::gaps::GapMaps;
use crate::geometry::bounds;
use crate::lights::texel_extent;
use crate::map_fit::FittedPhotons;
use crate::passes::map_resolve::MapResolve;
use crate::passes::photon_path::PhotonPath;
use crate::passes::photon_trace::PhotonTrace;
use crate::shared::emission::{PATH_REFLECTED, PATH_REFRACTED};
use crate::shared::flux::QUANTUM;
use crate::shared::landing_search::{LANDING_DISTANCE, LANDING_PLANE};
use crate::shared::photons::{EMISSION_GRID, EMISSION_QUEUE, Photons};
use crate::shared::triangle::TRIANGLE_REFRACTS;
use crate::{Interfaces, LandingUpdate, PlanError, Splat};

/// How photons find their way, and what they take for it.
#[derive(Clone, Copy)]
pub(crate) enum Tracer {
    /// By what views show: `photon_trace`.
    Views { exit: ResourceId, interfaces: u32, exit_iterations: u32, exit_reach: f32 },
    /// Along paths through the scene's geometry: `photon_path`.
    Paths { bvh: ResourceId, orders: u32 },
}

impl Caustics<'_> {
    /// The steps of light `i` from its photons to its map.
    pub(crate) fn photons(&mut self, i: usize, label: &str) -> Result<(), PlanError> {
        let setup = &self.setups[i];
        let (landing_view, faces, map_view) = (setup.landing_view, setup.faces, setup.map_view);
        let settings = self.settings;
        let emission = self.view(setup.views.start);
        let map = self.view(landing_view);
        let reach = |flags| {
            let (low, high) = bounds(self.geometry.flagged_corners(flags)).unwrap_or_default();
            low.distance(high) as f32
        };
        let splat = splat_shape(settings.splat);
        let photons = Photons {
            emission_view: setup.views.start,
            landing_view,
            landing_faces: faces,
            map_view,
            first_band: setup.first_band,
            materials: self.scene.materials.len() as u32,
            first_ledger: setup.first_ledger,
            emission: if self.refinement.is_some() { EMISSION_QUEUE } else { EMISSION_GRID },
            sample_stride: 1,
            max_groups: self.resources.max_groups(),
            path: PATH_REFRACTED,
            casters: TRIANGLE_REFRACTS,
            rule: settings.refraction_rule.code(),
            landing_iterations: settings.ray_geo_iterations,
            landing_update: match settings.ray_geo_update {
                LandingUpdate::Distance => LANDING_DISTANCE,
                LandingUpdate::Plane => LANDING_PLANE,
            },
            splat_taps: splat.taps,
            landing_center: setup.landing_center,
            range: setup.range,
            spot_axis: setup.spot_axis,
            spot_scale: setup.spot_scale,
            spot_offset: setup.spot_offset,
            splat_sigma: splat.sigma,
            splat_share: splat.share,
            guard_texels: guard_texels(settings, map.size.x) as f32,
            splat_spacing: emission.texel_slope / map.texel_slope,
            reserved0: 0,
            reserved1: 0,
        };
        let largest = setup.bands.largest;
        let scale = match settings.shah_intensity {
            // A photon at most brings a whole weight to the texel where it lands, of any size; one part in QUANTUM of it.
            Some(intensity) => {
                largest * intensity * 4.0 / f64::from(settings.emission_size) / f64::from(QUANTUM)
            }
            None => largest * texel_extent(&emission) / f64::from(QUANTUM) / texel_extent(&map),
        };
        let resolve = MapResolve {
            view: map_view,
            faces,
            scale: scale as f32,
            power: settings.artistic_power.unwrap_or(1.0) as f32,
            first_texel: 0,
            scale_view: landing_view,
            reserved0: 0,
            reserved1: 0,
        };
        let exit = if setup.exits { self.shared.exit } else { self.resources.nothing() };
        let interfaces = if setup.exits && settings.interfaces == Interfaces::Two { 2 } else { 1 };
        let tracer = |flags, orders| match self.bvh {
            Some(bvh) => Tracer::Paths { bvh, orders },
            None => Tracer::Views {
                exit,
                interfaces,
                exit_iterations: settings.exit_iterations,
                exit_reach: reach(flags),
            },
        };
        let tracers = [tracer(TRIANGLE_REFRACTS, settings.bounces + 1), tracer(setup.reflecting, 1)];
        let wavelengths = setup.bands.wavelengths_nm.len() as u32;
        let trace_groups = self.resources.groups(emission.size.to_array(), wavelengths, "emission_size")?;
        let resolve_groups = self.resources.groups(map.size.to_array(), faces, "map_size")?;
        let refinement = self.refinement.clone();
        let (refracted, reflecting) = (setup.refracted, setup.reflecting);
        let casters = if refracted { TRIANGLE_REFRACTS | reflecting } else { reflecting };
        let reflected = Photons {
            path: PATH_REFLECTED,
            casters: reflecting,
            first_ledger: setup.first_ledger + if refracted { self.wavelengths() } else { 0 },
            landing_center: setup.reflected_center,
            // Reflected light goes far: its map shows all receivers.
            map_view: landing_view,
            ..photons
        };
        let reflected_resolve =
            MapResolve { view: landing_view, first_texel: self.first_reflected(setup), ..resolve };
        let reflected_landing = self.reflected_landing(setup);
        let gaps = self.gaps.clone().filter(|_| setup.gaps);
        if let Some(refinement) = &refinement {
            let view = EmissionView { entry: self.shared.entry, exit, wavelengths, casters };
            self.refine(refinement, label, &view);
            let light = self.setups[..i].iter().filter(|s| s.caustic).count();
            self.keep_heads(refinement, light);
        }
        let landing = self.shared.landing;
        let [into_glass, back] = tracers;
        let paths = [
            (refracted, label.to_owned(), into_glass, photons, landing, gaps, resolve),
            (
                reflecting != 0,
                format!("{label}, reflected"),
                back,
                reflected,
                reflected_landing,
                None,
                reflected_resolve,
            ),
        ];
        for (_, label, tracer, photons, landing, gaps, resolve) in
            paths.into_iter().filter(|(kept, ..)| *kept)
        {
            let (map_buffer, caustic) = (self.shared.map, self.shared.caustic);
            let landed = gaps.as_ref().map_or(map_buffer, |g| g.filled);
            if let Some(bounds) = self.landing_bounds.filter(|_| photons.map_view != landing_view) {
                let fitted = FittedPhotons { tracer, photons, wavelengths, landing, map_size: map.size.x };
                self.fit_map(bounds, &label, &fitted)?;
            }
            self.resources.plan.steps.push(Step::ClearBuffer { buffer: map_buffer });
            let pass = self.trace_step(&label, &tracer, photons, landing, map_buffer);
            self.resources.plan.steps.push(if refinement.is_some() {
                let arguments = self.queue();
                Step::DispatchIndirect { pass, arguments, offset_bytes: QUEUE_ARGUMENTS_BYTES }
            } else {
                Step::Dispatch { pass, groups: trace_groups }
            });
            if let Some(gaps) = &gaps {
                let light = self.setups[..i].iter().filter(|s| s.gaps).count();
                let maps = GapMaps {
                    size: map.size,
                    faces,
                    map: map_buffer,
                    landing: self.shared.landing,
                    landing_view,
                    map_view,
                };
                self.fill_gaps(gaps, &label, light, &maps)?;
            }
            let bindings = [self.views, landed, caustic].map(Bound::from).to_vec();
            self.dispatch("map_resolve", &label, &resolve, bindings, resolve_groups);
        }
        Ok(())
    }

    /// The tiles that photons start in, where they are not all.
    fn queue(&self) -> ResourceId {
        self.refinement.as_ref().map_or(self.shared.no_queue, |r| r.photons())
    }

    /// The pass that traces photons into `map`.
    pub(crate) fn trace_step(
        &mut self,
        label: &str,
        tracer: &Tracer,
        photons: Photons,
        landing: ResourceId,
        map: ResourceId,
    ) -> PassStep {
        let ledger = self.ledger.expect("plans with caustics have a ledger");
        let (shared, queue) = (&self.shared, self.queue());
        let (triangles, views, bands, optics) = (self.triangles, self.views, self.bands, shared.optics);
        match *tracer {
            Tracer::Views { exit, interfaces, exit_iterations, exit_reach } => {
                let bindings =
                    [triangles, views, bands, optics, shared.entry, exit, landing, map, ledger, queue];
                let params = PhotonTrace { photons, interfaces, exit_iterations, exit_reach, reserved0: 0 };
                self.pass_step("photon_trace", label, &params, bindings.map(Bound::from).to_vec())
            }
            Tracer::Paths { bvh, orders } => {
                let bindings = [triangles, bvh, views, bands, optics, landing, map, ledger, queue];
                let params = PhotonPath { photons, orders, reserved0: 0, reserved1: 0, reserved2: 0 };
                self.pass_step("photon_path", label, &params, bindings.map(Bound::from).to_vec())
            }
        }
    }
}

/// Splats that follow the photons' spacing: standard deviation over it, the least, and the farthest reach.
const AUTO_SHARE: f32 = 0.6;
const AUTO_LEAST_SIGMA: f32 = 0.5;
pub(crate) const AUTO_MOST_TAPS: u32 = 8;

struct SplatShape {
    taps: u32,
    sigma: f32,
    share: f32,
}

fn splat_shape(splat: Splat) -> SplatShape {
    match splat {
        Splat::Point => SplatShape { taps: 0, sigma: 1.0, share: 0.0 },
        Splat::Gaussian { radius } => SplatShape { taps: radius, sigma: 0.5 * radius as f32, share: 0.0 },
        Splat::Auto => SplatShape { taps: AUTO_MOST_TAPS, sigma: AUTO_LEAST_SIGMA, share: AUTO_SHARE },
    }
}
