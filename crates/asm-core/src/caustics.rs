//! The passes that carry each light from its source to its map, whatever the map is then used for.
//!
//! Per light: what its emission view sees first (glass, or what stands before it), the back faces of the glass, the opaque
//! surfaces behind the front of the glass where light may land, all opaque surfaces for shadows; then photons, then the map
//! as floats. Lights run one after the other and share textures and map, so memory does not grow with their number.

use std::rc::Rc;
use std::sync::Arc;

use frame_plan::{Bound, Limits, PassStep, ResourceId, Step, Targets, TextureFormat};
use glam::DVec3;
use spectral_scene::{Effects, Scene};

use crate::bands::Glass;
use crate::bvh;
use crate::decisions::{Grounds, Output, decisions};
use crate::emission::Refinement;
use crate::faces::mark_faces;
use crate::footprints::Footprints;
use crate::gaps::Gaps;
use crate::geometry::Geometry;
use crate::lights::{LightSetup, Purpose, Receivers, light_setups, silhouette_size};
use crate::map_fit::bounds_buffer;
use crate::passes::visibility::{VISIBILITY_ALL_FACES, VISIBILITY_BACK_FACES, Visibility};
use crate::photons::AUTO_MOST_TAPS;
use crate::planner::GeometryCache;
use crate::resources::{Resources, cleared};
use crate::shared::footprint_light::RunningBand;
use crate::shared::irradiance::Light as LightParams;
use crate::shared::ledger::{LEDGER_ROWS, LEDGER_WORDS};
use crate::shared::optics::Optics;
use crate::shared::photons::Band;
use crate::shared::triangle::Triangle;
use crate::shared::view::View;
use crate::statistics::{Books, LightBooks};
use crate::{Emission, Method, PlanError, Refraction, Settings, Splat, WorkingSpace};

/// What a pass that shades with a light binds.
pub(crate) struct LightStep {
    pub(crate) label: String,
    /// Which of the lights that shine.
    pub(crate) light: u32,
    pub(crate) params: LightParams,
    pub(crate) direct: ResourceId,
    pub(crate) landing: ResourceId,
    pub(crate) reflected: ResourceId,
    pub(crate) entry: ResourceId,
    pub(crate) caustic: ResourceId,
}

/// A plan up to the maps of all lights.
pub(crate) struct Caustics<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) settings: &'a Settings,
    pub(crate) space: WorkingSpace,
    pub(crate) geometry: Arc<Geometry>,
    pub(crate) resources: Resources<'a>,
    pub(crate) triangles: ResourceId,
    pub(crate) bands: ResourceId,
    pub(crate) views: ResourceId,
    pub(crate) ledger: Option<ResourceId>,
    effects: Effects,
    pub(crate) setups: Vec<LightSetup>,
    pub(crate) shared: Shared,
    pub(crate) refinement: Option<Rc<Refinement>>,
    pub(crate) gaps: Option<Rc<Gaps>>,
    /// Of the map of one path.
    texels: u64,
    pub(crate) landing_bounds: Option<ResourceId>,
    pub(crate) most_zoom: f64,
    /// The tree over all triangles, where photons go along paths through them.
    pub(crate) bvh: Option<ResourceId>,
    footprints: Option<Rc<Footprints>>,
    /// The object to bake onto.
    receiver: Option<usize>,
}

/// Resources that lights use in turn.
pub(crate) struct Shared {
    pub(crate) optics: ResourceId,
    pub(crate) entry: ResourceId,
    pub(crate) exit: ResourceId,
    emission_depth: ResourceId,
    pub(crate) landing: ResourceId,
    /// Where reflected light lands, if that is not what another texture holds.
    reflected: ResourceId,
    direct: ResourceId,
    map_depth: ResourceId,
    landing_depth: ResourceId,
    pub(crate) map: ResourceId,
    pub(crate) caustic: ResourceId,
    /// Bound where photons come from a grid, and where no bounds are kept.
    pub(crate) no_queue: ResourceId,
}

impl<'a> Caustics<'a> {
    pub(crate) fn new(
        cache: &mut GeometryCache,
        scene: &'a Scene,
        settings: &'a Settings,
        limits: &'a Limits,
        purpose: &Purpose,
    ) -> Result<Self, PlanError> {
        let space = WorkingSpace::of(scene);
        let effects = Effects::required_by(scene);
        let receiver = match purpose.receivers {
            Receivers::Object(object) => Some(object),
            Receivers::Opaque => None,
        };
        let geometry = cache.geometry(scene, &space, receiver)?;
        let glasses = Glass::of(scene);
        let (setups, mut views) =
            light_setups(scene, settings, &effects, &space, &geometry, purpose, &glasses)?;
        views.extend(purpose.camera);

        let mut resources = Resources::new(purpose.name.clone(), limits);
        let bands: Vec<Band> = setups.iter().flat_map(|s| s.bands.bands()).collect();
        let running_bands: Vec<RunningBand> = setups.iter().flat_map(|s| s.bands.running_bands()).collect();
        let optics: Vec<Optics> =
            setups.iter().flat_map(|s| s.bands.optics(&glasses, space.metres_per_unit)).collect();
        let triangles = if settings.method == Method::Footprint {
            let mut triangles = geometry.triangles.clone();
            mark_faces(&mut triangles);
            resources.filled("triangles", &triangles)?
        } else {
            resources.filled::<Triangle>("triangles", &geometry.triangles)?
        };
        let views = resources.filled("views", &views)?;
        let bands = if running_bands.is_empty() {
            resources.filled("bands", &bands)?
        } else {
            resources.filled("bands", &running_bands)?
        };
        let (shared, ledger) =
            shared_resources(&mut resources, &setups, settings, purpose, &geometry, &optics)?;
        let lights = setups.iter().filter(|s| s.caustic).count();
        let refinement =
            if lights > 0 { Refinement::new(&mut resources, settings, lights)?.map(Rc::new) } else { None };
        let texels = map_texels(purpose, &setups);
        let gaps = Gaps::new(&mut resources, settings, &setups, texels)?.map(Rc::new);
        let landing_bounds = bounds_buffer(&mut resources, &setups)?;
        let bvh = if settings.refraction() == Refraction::Traced && lights > 0 {
            Some(resources.filled("bvh", &bvh::build(&geometry.triangles)?)?)
        } else {
            None
        };
        let footprints = Footprints::new(&mut resources, settings, &setups, bvh)?.map(Rc::new);
        Ok(Self {
            scene,
            settings,
            space,
            geometry,
            resources,
            triangles,
            bands,
            views,
            ledger,
            effects,
            setups,
            shared,
            refinement,
            gaps,
            texels,
            landing_bounds,
            most_zoom: purpose.most_zoom,
            bvh,
            footprints,
            receiver,
        })
    }

    /// Write down what is kept and left out, and why.
    pub(crate) fn decide(&mut self, output: &Output<'_>) {
        let grounds = Grounds {
            scene: self.scene,
            settings: self.settings,
            effects: &self.effects,
            geometry: &self.geometry,
            setups: &self.setups,
        };
        self.resources.plan.decisions = decisions(&grounds, output);
    }

    /// Steps that come before any light's.
    pub(crate) fn begin(&mut self) {
        for buffer in self.ledger.into_iter().chain(self.gaps.as_ref().map(|g| g.energy)) {
            self.resources.plan.steps.push(Step::ClearBuffer { buffer });
        }
    }

    /// XYZ lux or candela of each light that shines as each material reflects it.
    pub(crate) fn reflected_xyz(&self) -> impl Iterator<Item = &[[f64; 3]]> {
        self.setups.iter().map(|setup| setup.bands.reflected_xyz.as_slice())
    }

    /// Number of lights that shine.
    pub(crate) fn lights(&self) -> usize {
        self.setups.len()
    }

    /// Index of the camera's view, if there is one.
    pub(crate) fn camera_view(&self) -> u32 {
        self.setups.last().map_or(0, |s| s.views.end)
    }

    /// What the host needs to read the ledger.
    pub(crate) fn books(&self) -> Books {
        let setups = self.setups.iter().enumerate().filter(|(_, s)| s.caustic);
        let refinement = self.refinement.as_deref();
        let wavelengths = self.wavelengths();
        let light = |(i, setup): (usize, &LightSetup)| LightBooks {
            footprints: self.footprints.as_ref().map(|f| f.books(i, setup, self.settings)),
            ..setup.books(&self.space, &self.view(setup.views.start), refinement, wavelengths)
        };
        Books {
            ledger: self.ledger,
            queue_heads: refinement.map(|r| r.heads),
            gap_energy: self.gaps.as_ref().map(|g| g.energy),
            view_counts: None,
            footprint_work: self.footprints.as_ref().map(|f| f.work),
            lights: setups.map(light).collect(),
        }
    }

    /// Some light is thrown back.
    pub(crate) fn reflects(&self) -> bool {
        self.setups.iter().any(|s| s.reflecting != 0)
    }

    /// Wavelengths of all lights.
    pub(crate) fn wavelengths(&self) -> u32 {
        self.setups.iter().map(|s| s.bands.wavelengths_nm.len() as u32).sum()
    }

    pub(crate) fn view(&self, index: u32) -> View {
        let bytes =
            self.resources.plan.resources[self.views.0 as usize].initial.as_deref().unwrap_or_default();
        let size = size_of::<View>();
        bytemuck::pod_read_unaligned(&bytes[index as usize * size..][..size])
    }

    /// The steps of light `i` up to its map.
    pub(crate) fn light(&mut self, i: usize) -> Result<LightStep, PlanError> {
        let setup = &self.setups[i];
        let label = format!("light {} `{}`", setup.index, setup.name);
        let (landing_view, faces) = (setup.landing_view, setup.faces);
        let matt = 0..self.geometry.matt;
        let lit = match self.receiver {
            Some(receiver) if setup.receiver_view.is_some() => self.geometry.objects[receiver].clone(),
            _ => matt.clone(),
        };
        let opaque = 0..self.geometry.opaque;
        let all = 0..self.geometry.triangles.len() as u32;
        let glass = opaque.end..all.end;
        let from = setup.landing_from as f32;
        let mut draws = Vec::new();
        let seen = VISIBILITY_ALL_FACES;
        for face in 0..faces {
            let view = landing_view + face;
            let map = |texture| (texture, self.shared.landing_depth, face);
            if setup.caustic {
                let from_distance = if setup.cut { from } else { 0.0 };
                draws.push(("landing", map(self.shared.landing), view, lit.clone(), seen, from_distance));
            }
            if lands_apart(setup, &self.geometry) {
                let target = map(self.shared.reflected);
                draws.push(("landing of reflected light", target, view, matt.clone(), seen, 0.0));
            }
        }
        if setup.shadows && (setup.separate_direct || !setup.caustic) {
            for face in 0..setup.direct_faces {
                let target = (self.shared.direct, self.shared.map_depth, face);
                draws.push(("shadow", target, setup.direct_view + face, opaque.clone(), seen, 0.0));
            }
        }
        if setup.caustic {
            let emission = |texture| (texture, self.shared.emission_depth, 0);
            let view = setup.silhouette_view;
            draws.push(("entry", emission(self.shared.entry), view, all, VISIBILITY_ALL_FACES, 0.0));
            if setup.exits {
                draws.push(("exit", emission(self.shared.exit), view, glass, VISIBILITY_BACK_FACES, 0.0));
            }
        }
        for (what, (texture, depth, layer), view, triangles, faces, from_distance) in draws {
            let face = if layer > 0 { format!(", face {layer}") } else { String::new() };
            let params = Visibility { view, first_triangle: triangles.start, faces, from_distance };
            self.draw_visibility(
                format!("{label}, {what}{face}"),
                params,
                triangles.len() as u32,
                texture,
                depth,
                layer,
            );
        }
        match self.footprints.clone() {
            Some(footprints) if self.setups[i].caustic => self.lay_footprints(&footprints, i, &label)?,
            None if self.setups[i].caustic => self.photons(i, &label)?,
            _ => {}
        }
        Ok(self.light_step(i, label))
    }

    /// First texel of the map of reflected light: behind that of refracted light, if there is one.
    pub(crate) fn first_reflected(&self, setup: &LightSetup) -> u32 {
        if setup.refracted { self.texels as u32 } else { 0 }
    }

    /// What shows where reflected light lands: all matt surfaces, as far as the light sees them.
    pub(crate) fn reflected_landing(&self, setup: &LightSetup) -> ResourceId {
        if setup.receiver_view.is_some() {
            self.shared.landing
        } else if lands_apart(setup, &self.geometry) {
            self.shared.reflected
        } else if setup.cut {
            self.shared.direct // nothing opaque is a mirror
        } else {
            self.shared.landing
        }
    }

    fn light_step(&mut self, i: usize, label: String) -> LightStep {
        let setup = &self.setups[i];
        let (landing_view, faces) = (setup.landing_view, setup.faces);
        let [x, y, z] = setup.bands.xyz;
        let params = LightParams {
            xyz: DVec3::new(x, y, z).as_vec3(),
            metres_per_unit: self.space.metres_per_unit as f32,
            spot_axis: setup.spot_axis,
            spot_scale: setup.spot_scale,
            spot_offset: setup.spot_offset,
            range: setup.range,
            landing_from: if setup.cut { setup.landing_from as f32 } else { 0.0 },
            direct_view: setup.direct_view,
            direct_faces: if setup.shadows { setup.direct_faces } else { 0 },
            landing_view,
            landing_faces: if setup.refracted { faces } else { 0 },
            emission_view: setup.silhouette_view,
            emits: u32::from(setup.caustic),
            reflected_faces: if setup.reflecting != 0 { faces } else { 0 },
            first_reflected: self.first_reflected(setup),
            map_view: setup.map_view,
            receiver_map: u32::from(setup.receiver_view.is_some()),
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let reflected = self.reflected_landing(setup);
        let (caustic, separate, shadows) = (setup.caustic, setup.separate_direct, setup.shadows);
        let nothing = self.resources.nothing();
        LightStep {
            label,
            light: i as u32,
            params,
            direct: match (shadows, separate || !caustic) {
                (false, _) => nothing,
                (true, true) => self.shared.direct,
                (true, false) => self.shared.landing,
            },
            landing: if caustic { self.shared.landing } else { nothing },
            reflected: if setup.reflecting != 0 { reflected } else { nothing },
            entry: if caustic { self.shared.entry } else { nothing },
            caustic: self.shared.caustic,
        }
    }

    /// A draw of `count` triangles into a layer of a visibility buffer.
    pub(crate) fn draw_visibility(
        &mut self,
        label: String,
        params: Visibility,
        count: u32,
        texture: ResourceId,
        depth: ResourceId,
        layer: u32,
    ) {
        let plan = &mut self.resources.plan;
        let params = plan.add_params(format!("visibility: {label}"), &params);
        plan.steps.push(Step::Draw {
            pass: PassStep {
                pass: "visibility".into(),
                label,
                params: Some(params),
                bindings: vec![self.triangles.into(), self.views.into()],
            },
            targets: Targets { color: vec![cleared(texture, layer)], depth: Some(cleared(depth, 0)) },
            vertices: 3 * count,
            instances: 1,
        });
    }

    /// A compute pass over 8 x 8 texels per workgroup.
    pub(crate) fn dispatch<T: bytemuck::Pod>(
        &mut self,
        pass: &str,
        label: &str,
        params: &T,
        bindings: Vec<Bound>,
        groups: [u32; 3],
    ) {
        let pass = self.pass_step(pass, label, params, bindings);
        self.resources.plan.steps.push(Step::Dispatch { pass, groups });
    }

    pub(crate) fn pass_step<T: bytemuck::Pod>(
        &mut self,
        pass: &str,
        label: &str,
        params: &T,
        bindings: Vec<Bound>,
    ) -> PassStep {
        let params = self.resources.plan.add_params(format!("{pass}: {label}"), params);
        PassStep { pass: pass.into(), label: label.into(), params: Some(params), bindings }
    }
}

/// How far beside a surface photons are put down, in texels of a map of `size`: as far as their splats reach what the bilinear
/// lookup at the surface's edge reads, but not so far that small maps become mostly edge.
pub(crate) fn guard_texels(settings: &Settings, size: u32) -> u32 {
    if settings.method == Method::Footprint {
        return 1.min(size / 16); // footprints do not blur
    }
    match settings.splat {
        Splat::Point => 0,
        Splat::Gaussian { radius } => (radius + 1).min(size / 4),
        Splat::Auto => (AUTO_MOST_TAPS + 1).min(size / 16),
    }
}

/// No other texture shows where reflected light lands: refracted light lands farther behind, and in what throws shadows there
/// are mirrors.
fn lands_apart(setup: &LightSetup, geometry: &Geometry) -> bool {
    let shows_matt = setup.shadows && geometry.opaque == geometry.matt;
    setup.reflecting != 0 && setup.receiver_view.is_none() && setup.cut && !shows_matt
}

/// Most views of any light's map.
fn map_faces(setups: &[LightSetup]) -> u32 {
    setups.iter().map(|s| s.faces).max().unwrap_or(1)
}

/// Texels of the map, of all its views.
fn map_texels(purpose: &Purpose, setups: &[LightSetup]) -> u64 {
    let [width, height] = landing_size(purpose, setups).map(u64::from);
    width * height * u64::from(map_faces(setups))
}

/// Texels of what shows where light may land, which are the map's.
fn landing_size(purpose: &Purpose, setups: &[LightSetup]) -> [u32; 2] {
    let receiver_view = setups.iter().find_map(|s| s.receiver_view);
    receiver_view.map_or([purpose.map_size; 2], |view| view.size.to_array())
}

fn shared_resources(
    resources: &mut Resources<'_>,
    setups: &[LightSetup],
    settings: &Settings,
    purpose: &Purpose,
    geometry: &Geometry,
    optics: &[Optics],
) -> Result<(Shared, Option<ResourceId>), PlanError> {
    let nothing = resources.nothing();
    let caustic = setups.iter().any(|s| s.caustic);
    let exits = setups.iter().any(|s| s.exits);
    let direct = setups.iter().any(|s| s.shadows && (s.separate_direct || !s.caustic));
    let apart = setups.iter().any(|s| lands_apart(s, geometry));
    let faces = map_faces(setups);
    let emission = [silhouette_size(settings); 2];
    let map = [purpose.map_size; 2];
    let landing_texels = landing_size(purpose, setups);
    let direct_faces = setups.iter().map(|s| s.direct_faces).max().unwrap_or(1);
    let texels = map_texels(purpose, setups);
    let mut texture = |needed: bool, name: &str, format, size, layers, remedy| {
        if needed { resources.texture(name, format, size, layers, remedy) } else { Ok(nothing) }
    };
    let (id, depth) = (TextureFormat::R32Uint, TextureFormat::Depth32Float);
    let entry = texture(caustic, "entry", id, emission, 1, "emission_size")?;
    let exit = texture(exits, "exit", id, emission, 1, "emission_size")?;
    let emission_depth = texture(caustic, "emission depth", depth, emission, 1, "emission_size")?;
    let landing = texture(caustic, "landing", id, landing_texels, faces, "map_size")?;
    let reflected = texture(apart, "landing of reflected light", id, map, faces, "map_size")?;
    let direct = texture(direct, "shadow", id, map, direct_faces, "map_size")?;
    let map_depth = texture(!setups.is_empty(), "map depth", depth, map, 1, "map_size")?;
    let landing_depth = if landing_texels == map {
        map_depth
    } else {
        texture(caustic, "landing depth", depth, landing_texels, 1, "map_size")?
    };
    // Where nothing makes a map, the buffer that shading binds is the smallest there is.
    let paths = |s: &LightSetup| u32::from(s.refracted) + u32::from(s.reflecting != 0);
    let paths = setups.iter().map(paths).max().unwrap_or(0);
    let shared = Shared {
        optics: resources.filled("optics", optics)?,
        entry,
        exit,
        emission_depth,
        landing,
        reflected,
        direct,
        map_depth,
        landing_depth,
        map: if caustic { resources.buffer("map", 24 * texels, "map_size")? } else { nothing },
        caustic: if caustic {
            resources.buffer("caustic", 16 * texels * u64::from(paths), "map_size")?
        } else {
            resources.filled("caustic", &[[0.0_f32; 4]])?
        },
        no_queue: if caustic && settings.emission() == Emission::Grid {
            resources.filled("no queue", &[0_u32; 4])?
        } else {
            nothing
        },
    };
    let mut ledger = None;
    if caustic {
        let wavelengths: usize = setups.iter().map(|s| s.bands.wavelengths_nm.len()).sum();
        let words = LEDGER_WORDS * LEDGER_ROWS * wavelengths * paths as usize;
        let id = resources.buffer("ledger", 4 * words as u64, "wavelengths")?;
        resources.make_readable(id);
        ledger = Some(id);
    }
    Ok((shared, ledger))
}
