//! Photons along exact paths, one per texel of the light's emission view and wavelength, in tiles of 8 x 8: each goes through every
//! surface of the scene, and leaves the first glass after each number of reflections inside it, until it lands. Twin of
//! `shaders/photon_path.wgsl`; how paths go on stands in [`crate::shared::light_path`], what photons leave in
//! [`crate::shared::photons`].

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::UVec2;

use super::{
    BVH_WGSL, CROSSING_WGSL, EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LANDING_SEARCH_WGSL, LEDGER_WGSL,
    LIGHT_PATH_WGSL, LIGHT_VIEWS_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL, PHOTONS_WGSL, REFRACT_WGSL,
    SPLAT_WGSL, TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::bvh::Surfaces;
use crate::shared::landing_search::LandingSearch;
use crate::shared::ledger::*;
use crate::shared::light_path::{Arrival, LightPaths};
use crate::shared::photons::{EMISSION_QUEUE, EMISSION_SAMPLE, Photon, PhotonTiles, Photons, Traced};

/// Uniform of the pass; mirrors `PhotonPath` in `shaders/photon_path.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PhotonPath {
    /// Where they start and what they leave.
    pub photons: Photons,
    /// Arrivals of a path, at most [`MOST_ORDERS`].
    pub orders: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Most arrivals of a path: a workgroup's threads keep theirs.
pub const MOST_ORDERS: u32 = 8;

/// All that an executor needs to build and run `photon_path`.
pub const PHOTON_PATH: PassInfo = PassInfo {
    name: "photon_path",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        REFRACT_WGSL,
        OPTICS_WGSL,
        FLUX_WGSL,
        LIGHT_VIEWS_WGSL,
        LEDGER_WGSL,
        CROSSING_WGSL,
        BVH_WGSL,
        EMISSION_WGSL,
        PHOTON_QUEUE_WGSL,
        FOOTPRINT_WGSL,
        SPLAT_WGSL,
        PHOTONS_WGSL,
        LANDING_SEARCH_WGSL,
        LIGHT_PATH_WGSL,
        include_str!("../../../../shaders/photon_path.wgsl"),
    ],
    params_struct: "PhotonPath",
    params_bytes: size_of::<PhotonPath>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("bvh", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("bands", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("map", BindingKind::Atomic),
        binding("ledger", BindingKind::Atomic),
        binding("queue", BindingKind::ReadAtomic),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let PhotonPath { photons, orders, .. } = args.params();
            let (triangles, views) = (args.read("triangles"), args.read("views"));
            let landing_visibility = args.texture("landing_visibility");
            let tiles = PhotonTiles { photons: &photons, views, bands: args.read("bands") };
            let inputs = Inputs {
                tiles,
                paths: LightPaths {
                    surfaces: Surfaces { bvh: args.read("bvh"), triangles },
                    views,
                    optics: args.read("optics"),
                    landing_visibility,
                    landing_view: photons.landing_view,
                    landing_faces: photons.landing_faces,
                    materials: photons.materials,
                    first_optics: photons.first_band,
                    orders,
                    asides: 0,
                    path: photons.path,
                    casters: photons.casters,
                    rule: photons.rule,
                    range: photons.range,
                },
                search: LandingSearch { photons: &photons, triangles, views, landing_visibility },
            };
            let trace = |texel, band, traced: &mut [Traced]| inputs.trace(texel, band, traced);
            let (wavelengths, map) = (args.groups()[2], args.atomics("map"));
            if photons.emission == EMISSION_SAMPLE {
                tiles.bounds(wavelengths, orders as usize, map, trace);
            } else {
                let queue = (photons.emission == EMISSION_QUEUE).then(|| args.atomics("queue"));
                tiles.lay_down(wavelengths, orders as usize, queue, map, args.atomics("ledger"), trace);
            }
        },
    },
};

/// What `photon_path` reads.
struct Inputs<'a> {
    tiles: PhotonTiles<'a>,
    paths: LightPaths<'a>,
    /// For what goes by beside a surface.
    search: LandingSearch<'a>,
}

impl Inputs<'_> {
    /// What a photon leaves where it arrives, and what the first glass has absorbed of that.
    fn arrive(&self, arrival: &Arrival, band: u32) -> (Traced, u32) {
        let Arrival { end, ray, met, part, length, medium, .. } = *arrival;
        let paths = &self.paths;
        let glass = paths.optics[((paths.first_optics + band) * paths.materials + medium) as usize];
        let mut photon = Photon { end, flux: part, ..Photon::default() };
        photon.absorb((-glass.absorption * length).exp());
        let absorbed = std::mem::take(&mut photon.absorbed);
        let material = |visible: u32| paths.surfaces.triangles[visible as usize - 1].material;
        let traced = if end == END_LANDED {
            match paths.locate(arrival) {
                Some(at) => {
                    let point = ray.origin + met.hit.distance * ray.direction;
                    self.tiles.put_down(photon, at, point, material(met.visible), band)
                }
                None => Traced::nothing(Photon { end: END_OUTSIDE_MAP, ..photon }),
            }
        } else if end == END_ESCAPED && self.tiles.photons.guard_texels > 0.0 {
            let near = self.search.find(ray);
            if near.beside {
                let photon = Photon { end: END_OUTSIDE_MAP, beside: true, ..photon };
                let point = ray.origin + near.distance * ray.direction;
                self.tiles.put_down(photon, near.at, point, material(near.visible), band)
            } else {
                Traced::nothing(photon)
            }
        } else {
            Traced::nothing(photon)
        };
        (traced, absorbed)
    }

    /// All arrivals of a photon; the books of its way stand with the first.
    fn trace(&self, texel: UVec2, band: u32, traced: &mut [Traced]) {
        let (light_ray, photon) = self.tiles.emitted(texel);
        let mut absorbed = 0;
        let left = self.paths.trace(light_ray, band, photon.aimed, |arrival| {
            let (at_arrival, in_glass) = self.arrive(&arrival, band);
            traced[arrival.order as usize] = at_arrival;
            absorbed += in_glass;
        });
        let first = &mut traced[0].photon;
        if left.end != END_LANDED {
            first.end = left.end;
            first.flux = photon.aimed;
        }
        first.aimed = photon.aimed;
        first.reflected = left.reflected;
        first.kept_inside = left.kept_inside;
        first.absorbed = left.absorbed + absorbed;
    }
}
