//! Caustics mapping (Shah et al.), one photon per texel of the light's emission view and wavelength, in tiles of 8 x 8. Twin
//! of `shaders/photon_trace.wgsl`; what photons leave stands in [`crate::shared::photons`].

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec3};

use super::{
    CROSSING_WGSL, EMISSION_WGSL, EXIT_SEARCH_WGSL, FLUX_WGSL, LANDING_SEARCH_WGSL, LEDGER_WGSL,
    LIGHT_VIEWS_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL, PHOTONS_WGSL, REFRACT_WGSL, SPLAT_WGSL, TRIANGLE_WGSL,
    VIEW_WGSL, VISIBILITY_TEXTURE, VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::crossing::{cross_surface, interface_reflectance, mirror_reflectance, reflect_at};
use crate::shared::emission::PATH_REFLECTED;
use crate::shared::exit_search::{EXIT_OF_BODY, Exit, Inside};
use crate::shared::flux::{flux_part, part_from};
use crate::shared::landing_search::LandingSearch;
use crate::shared::ledger::*;
use crate::shared::optics::Optics;
use crate::shared::photons::{EMISSION_QUEUE, EMISSION_SAMPLE, Photon, PhotonTiles, Photons, Traced};
use crate::shared::triangle::{
    NOTHING, PlaneHit, TRIANGLE_MIRROR, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle,
};
use crate::shared::view::{Ray, View};

/// Uniform of the pass; mirrors `PhotonTrace` in `shaders/photon_trace.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PhotonTrace {
    /// Where they start and what they leave.
    pub photons: Photons,
    /// 1: only the entry refracts (Shah); 2: the exit too.
    pub interfaces: u32,
    /// Guesses at the exit.
    pub exit_iterations: u32,
    /// No way through glass is longer.
    pub exit_reach: f32,
    /// Padding.
    pub reserved0: u32,
}

/// Reflections at a hollow mirror.
const MOST_REFLECTIONS: u32 = 4;

/// All that an executor needs to build and run `photon_trace`.
pub const PHOTON_TRACE: PassInfo = PassInfo {
    name: "photon_trace",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        REFRACT_WGSL,
        OPTICS_WGSL,
        FLUX_WGSL,
        LIGHT_VIEWS_WGSL,
        LEDGER_WGSL,
        CROSSING_WGSL,
        EXIT_SEARCH_WGSL,
        EMISSION_WGSL,
        PHOTON_QUEUE_WGSL,
        SPLAT_WGSL,
        PHOTONS_WGSL,
        LANDING_SEARCH_WGSL,
        include_str!("../../../../shaders/photon_trace.wgsl"),
    ],
    params_struct: "PhotonTrace",
    params_bytes: size_of::<PhotonTrace>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("bands", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("entry_visibility", VISIBILITY_TEXTURE),
        binding("exit_visibility", VISIBILITY_TEXTURE),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("map", BindingKind::Atomic),
        binding("ledger", BindingKind::Atomic),
        binding("queue", BindingKind::ReadAtomic),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let inputs = Inputs {
                params: args.params(),
                triangles: args.read("triangles"),
                views: args.read("views"),
                optics: args.read("optics"),
                entry_visibility: args.texture("entry_visibility"),
                exit_visibility: args.texture("exit_visibility"),
                landing_visibility: args.texture("landing_visibility"),
            };
            let params = &inputs.params.photons;
            let tiles = PhotonTiles { photons: params, views: inputs.views, bands: args.read("bands") };
            let trace = |texel, band, traced: &mut [Traced]| traced[0] = inputs.trace(&tiles, texel, band);
            let (wavelengths, map) = (args.groups()[2], args.atomics("map"));
            if params.emission == EMISSION_SAMPLE {
                tiles.bounds(wavelengths, 1, map, trace);
            } else {
                let queue = (params.emission == EMISSION_QUEUE).then(|| args.atomics("queue"));
                tiles.lay_down(wavelengths, 1, queue, map, args.atomics("ledger"), trace);
            }
        },
    },
};

/// What `photon_trace` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: PhotonTrace,
    /// All triangles.
    pub triangles: &'a [Triangle],
    /// All views.
    pub views: &'a [View],
    /// Band x material that photons go through.
    pub optics: &'a [Optics],
    /// First surface from the light.
    pub entry_visibility: TextureView<'a>,
    /// First back face of glass from the light.
    pub exit_visibility: TextureView<'a>,
    /// First opaque surface from the light behind the front of the glass.
    pub landing_visibility: TextureView<'a>,
}

/// What a photon meets first.
struct Entry {
    triangle: u32,
    hit: PlaneHit,
}

/// How a photon goes on behind all surfaces that it meets.
struct Way {
    ray: Ray,
    /// On the way to the landing, per working unit.
    absorption: f32,
}

/// Normal of the side that the light comes from.
fn lit_normal(front: &Triangle, hit: &PlaneHit) -> Vec3 {
    (if hit.facing < 0.0 { 1.0 } else { -1.0 }) * front.interpolated_normal(hit)
}

impl Inputs<'_> {
    /// Where a ray that has entered a refractor leaves it by the back faces that the light sees, or one in a hollow mirror meets
    /// its lit faces.
    fn find_exit(&self, view: &View, inside: Inside<'_>) -> Option<Exit> {
        let reflected = self.params.photons.path == PATH_REFLECTED;
        let faces = if reflected { &self.entry_visibility } else { &self.exit_visibility };
        inside.find_exit(view, self.params.exit_reach, self.params.exit_iterations, |texel| {
            faces.load_uint(texel.x, texel.y)
        })
    }

    /// Rasterisers round corners to parts of a texel, each in its own way: a texel's centre may lie just beside the triangle
    /// that it shows, or on an edge. The photon then enters by the triangle round about that its ray meets, whoever drew the
    /// view.
    fn entry_at(&self, view: &View, texel: UVec2, ray: Ray) -> Option<Entry> {
        let entry = |texel: UVec2| {
            let index = self.entry_visibility.load_uint(texel.x, texel.y).checked_sub(1)?;
            Some(Entry { triangle: index, hit: self.triangles[index as usize].plane_hit(ray) })
        };
        let mut first = entry(texel)?;
        if first.hit.well_inside() {
            return Some(first);
        }
        for side in 0..8 {
            if let Some(other) = entry(view.texel_beside(texel, side))
                && other.hit.is_preferred(other.triangle, &first.hit, first.triangle)
            {
                first = other;
            }
        }
        Some(first)
    }

    fn medium(&self, front: &Triangle, band: u32) -> Optics {
        self.optics[((self.params.photons.first_band + band) * self.params.photons.materials + front.material)
            as usize]
    }

    /// Into glass, and out again if it has a back face.
    fn refracted(&self, photon: &mut Photon, view: &View, light_ray: Ray, entry: &Entry, band: u32) -> Way {
        let params = &self.params;
        let front = &self.triangles[entry.triangle as usize];
        let hit = entry.hit;
        let medium = self.medium(front, band);
        let entering = hit.facing < 0.0;
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let first =
            cross_surface(light_ray.direction, lit_normal(front, &hit), front, eta, params.photons.rule);
        let ray =
            Ray { origin: light_ray.origin + hit.distance * light_ray.direction, direction: first.direction };
        if first.end != END_LANDED {
            photon.end = first.end;
            return Way { ray, absorption: 0.0 };
        }
        let emitted = photon.flux;
        photon.flux = flux_part(emitted, part_from(1.0 - first.reflectance));
        photon.reflected = emitted - photon.flux;
        photon.absorb(medium.surface);
        let open = front.flags & TRIANGLE_OPEN != 0;
        let inside = Way { ray, absorption: if entering && open { medium.absorption } else { 0.0 } };
        if !entering || params.interfaces != 2 {
            return inside;
        }
        let inside_glass =
            Inside { triangles: self.triangles, ray, object: front.object, side: EXIT_OF_BODY };
        let Some(exit) = self.find_exit(view, inside_glass) else {
            if !open {
                photon.end = END_NO_EXIT;
            }
            return inside;
        };
        photon.absorb((-medium.absorption * exit.hit.distance).exp());
        let back = &self.triangles[exit.triangle as usize];
        let normal = -back.interpolated_normal(&exit.hit);
        let second = cross_surface(ray.direction, normal, back, 1.0 / medium.index, params.photons.rule);
        let origin = ray.origin + exit.hit.distance * ray.direction;
        let outside = Way { ray: Ray { origin, direction: second.direction }, absorption: 0.0 };
        if second.end != END_LANDED {
            photon.end = second.end;
            return outside;
        }
        let left = flux_part(photon.flux, part_from(1.0 - second.reflectance));
        photon.kept_inside = photon.flux - left;
        photon.flux = left;
        photon.absorb(medium.surface);
        outside
    }

    /// Back from a mirror, or from glass; what goes in is absorbed there, or kept inside.
    fn reflected(&self, photon: &mut Photon, view: &View, light_ray: Ray, entry: &Entry, band: u32) -> Way {
        let front = &self.triangles[entry.triangle as usize];
        let hit = entry.hit;
        let medium = self.medium(front, band);
        let normal = lit_normal(front, &hit);
        let mirror = front.flags & TRIANGLE_MIRROR != 0;
        let outside = hit.facing < 0.0;
        let share = if mirror {
            mirror_reflectance(light_ray.direction, normal, medium.surface)
        } else {
            let eta = if outside { medium.index } else { 1.0 / medium.index };
            interface_reflectance(light_ray.direction, normal, eta, self.params.photons.rule)
        };
        let back = reflect_at(light_ray.direction, normal, front, share);
        let ray =
            Ray { origin: light_ray.origin + hit.distance * light_ray.direction, direction: back.direction };
        if back.end != END_LANDED {
            photon.end = back.end;
            return Way { ray, absorption: 0.0 };
        }
        let emitted = photon.flux;
        photon.flux = flux_part(emitted, part_from(back.reflectance));
        let rest = emitted - photon.flux;
        if mirror {
            photon.absorbed = rest;
        } else {
            photon.kept_inside = rest;
        }
        if mirror {
            let hollow =
                Inside { triangles: self.triangles, ray, object: front.object, side: hit.facing.signum() };
            return self.reflected_on(photon, view, hollow, band);
        }
        // Below an open surface it goes on through what the surface encloses.
        Way { ray, absorption: if outside { 0.0 } else { medium.absorption } }
    }

    /// From wall to wall of a hollow mirror, as along the inside of a ring.
    fn reflected_on(&self, photon: &mut Photon, view: &View, mut hollow: Inside<'_>, band: u32) -> Way {
        let mut reflections = 1;
        while let Some(wall) = self.find_exit(view, hollow).filter(|wall| wall.contained) {
            let ray = hollow.ray;
            let face = &self.triangles[wall.triangle as usize];
            let normal = -hollow.side * face.interpolated_normal(&wall.hit);
            let share = mirror_reflectance(ray.direction, normal, self.medium(face, band).surface);
            let back = reflect_at(ray.direction, normal, face, share);
            if back.end != END_LANDED || reflections == MOST_REFLECTIONS {
                photon.end = if back.end == END_LANDED { END_NO_EXIT } else { back.end };
                break;
            }
            photon.absorb(back.reflectance);
            let origin = ray.origin + wall.hit.distance * ray.direction;
            hollow.ray = Ray { origin, direction: back.direction };
            reflections += 1;
        }
        Way { ray: hollow.ray, absorption: 0.0 }
    }

    /// One photon from the light to the map, and what it leaves there.
    fn trace(&self, tiles: &PhotonTiles<'_>, texel: UVec2, band: u32) -> Traced {
        let photons = &self.params.photons;
        let view = &self.views[photons.emission_view as usize];
        let (light_ray, mut photon) = tiles.emitted(texel);
        let Some(entry) = self.entry_at(view, texel, light_ray) else {
            return Traced::nothing(photon);
        };
        let Entry { triangle, hit } = entry;
        let front = &self.triangles[triangle as usize];
        if front.flags & photons.casters == 0 {
            let shows_glass = || self.exit_visibility.load_uint(texel.x, texel.y) != NOTHING;
            if front.flags & TRIANGLE_REFRACTS == 0 && shows_glass() {
                photon.end = END_BLOCKED;
            }
            return Traced::nothing(photon);
        }
        if !hit.crosses || (photons.range > 0.0 && hit.distance > photons.range) {
            return Traced::nothing(photon);
        }

        photon.end = END_LANDED;
        let Way { ray, absorption } = if photons.path == PATH_REFLECTED {
            self.reflected(&mut photon, view, light_ray, &entry, band)
        } else {
            self.refracted(&mut photon, view, light_ray, &entry, band)
        };
        if photon.end != END_LANDED {
            return Traced::nothing(photon);
        }

        let search = LandingSearch {
            photons,
            triangles: self.triangles,
            views: self.views,
            landing_visibility: self.landing_visibility,
        };
        let landing = search.find(ray);
        photon.end = landing.end;
        if landing.end != END_LANDED && !landing.beside {
            return Traced::nothing(photon);
        }
        photon.astray = landing.astray;
        photon.beside = landing.beside;
        photon.absorb((-absorption * landing.distance).exp());
        let lit = self.triangles[landing.visible as usize - 1].material;
        tiles.put_down(photon, landing.at, ray.origin + landing.distance * ray.direction, lit, band)
    }
}
