//! Caustics mapping (Shah et al.), one photon per texel of the light's emission view and wavelength, in tiles of 8 x 8. Twin
//! of `shaders/photon_trace.wgsl`.
//!
//! The map is 64-bit fixed point per channel. One texel's flux at one wavelength is at most 2^30 units, a plan has fewer
//! than 2^34 texels times wavelengths, so a texel that receives every photon holds less than 2^64. A photon's flux is an
//! integer from the start and every stage takes an integer part of it, so the ledger's rows add up exactly. A deposit is
//! within half a unit of flux x weight per channel, and its Gaussian taps sum to it; weights are parts of the largest of all
//! wavelengths and materials, so none exceeds 1, and each is within half of 2^-31 of that.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    CROSSING_WGSL, EMISSION_WGSL, EXIT_SEARCH_WGSL, FLUX_WGSL, LEDGER_WGSL, LIGHT_VIEWS_WGSL, OPTICS_WGSL,
    PHOTON_QUEUE_WGSL, REFRACT_WGSL, SPLAT_WGSL, TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE,
    VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::crossing::{cross_surface, interface_reflectance, mirror_reflectance, reflect_at};
use crate::shared::emission::{PATH_REFLECTED, spot_falloff};
use crate::shared::exit_search::{EXIT_OF_BODY, Exit, Inside};
use crate::shared::flux::{QUANTUM, add_64, flux_part, part_from};
use crate::shared::ledger::*;
use crate::shared::light_views::{Located, locate, locate_clamped, on_map};
use crate::shared::optics::Optics;
use crate::shared::photon_queue::{QUEUE_COUNT, QUEUE_HEAD, queue_cell};
use crate::shared::splat::splat;
use crate::shared::triangle::{
    NOTHING, PlaneHit, SAME_SURFACE, TRIANGLE_MIRROR, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle,
    visible_in_layer,
};
use crate::shared::view::{Ray, View};

/// Uniform of the pass; mirrors `PhotonTrace` in `shaders/photon_trace.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PhotonTrace {
    /// View fitted to the refractors.
    pub emission_view: u32,
    /// First view of the map.
    pub landing_view: u32,
    /// Number of views of the map.
    pub landing_faces: u32,
    /// First row of this light, in `bands`, `optics` and `ledger`.
    pub first_band: u32,
    /// Row length of `bands` and `optics`.
    pub materials: u32,
    /// 1: only the entry refracts (Shah); 2: the exit too.
    pub interfaces: u32,
    /// Guesses at the exit.
    pub exit_iterations: u32,
    /// Guesses at the landing.
    pub landing_iterations: u32,
    /// [`LANDING_DISTANCE`] or [`LANDING_PLANE`].
    pub landing_update: u32,
    /// Texels to each side of the landing's, 0 is a point; where splats follow the photons' spacing, the most.
    pub splat_taps: u32,
    /// Standard deviation, texels; where splats follow the photons' spacing, the least.
    pub splat_sigma: f32,
    /// No way through glass is longer.
    pub exit_reach: f32,
    /// Middle of the receivers' bounds.
    pub landing_center: Vec3,
    /// Light beyond this distance is dark; 0 has no end.
    pub range: f32,
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// See `spot_scale`.
    pub spot_offset: f32,
    /// Standard deviation over the distance to the next photon; 0 keeps `splat_sigma`.
    pub splat_share: f32,
    /// Distance between photons that nothing bends, texels of the landing view.
    pub splat_spacing: Vec2,
    /// Photons that arrive up to so many texels beside a surface are put down too.
    pub guard_texels: f32,
    /// [`EMISSION_GRID`] or [`EMISSION_QUEUE`].
    pub emission: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// `PATH_*`.
    pub path: u32,
    /// `TRIANGLE_*` of the surfaces that photons of this path follow.
    pub casters: u32,
    /// First row of this light and path, in `ledger`.
    pub first_ledger: u32,
    /// First of the map's views, one per view of where light may land.
    pub map_view: u32,
    /// Of [`EMISSION_SAMPLE`].
    pub sample_stride: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Tiles of the whole emission view.
pub const EMISSION_GRID: u32 = 0;
/// Tiles that the queue holds.
pub const EMISSION_QUEUE: u32 = 1;
/// One texel in [`PhotonTrace::sample_stride`] along each side, and `map` holds only where they land: [`BOUNDS_WORDS`] per face.
pub const EMISSION_SAMPLE: u32 = 2;

/// How far the landings lie at most from the right, the left, the bottom and the top of a face, in whole texels.
pub const BOUNDS_WORDS: usize = 4;

/// Reflections at a hollow mirror.
const MOST_REFLECTIONS: u32 = 4;

/// Photons along each side of a workgroup, which know each other's landings.
const TILE: u32 = 8;

/// Two landings farther apart than this, texels, do not belong to one beam.
const FARTHEST_NEIGHBOUR: f32 = 16.0;

/// Standard deviations that a splat reaches at least, but for this part of a texel.
const REACH_SIGMAS: f32 = 2.5;
const REACH_ROUNDING: f32 = 0.25;

/// Shah's update: the distance of the surface point below the last guess.
pub const LANDING_DISTANCE: u32 = 0;
/// The ray against the plane of the triangle below the last guess.
pub const LANDING_PLANE: u32 = 1;

/// Photons at one wavelength of one light where they land on one material; mirrors `Band`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Band {
    /// XYZ as parts, see [`part_from`].
    pub weight: [u32; 3],
    /// Padding.
    pub reserved: u32,
}

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
                bands: args.read("bands"),
                optics: args.read("optics"),
                entry_visibility: args.texture("entry_visibility"),
                exit_visibility: args.texture("exit_visibility"),
                landing_visibility: args.texture("landing_visibility"),
            };
            let queue = (inputs.params.emission == EMISSION_QUEUE).then(|| args.atomics("queue"));
            let wavelengths = args.groups()[2];
            if inputs.params.emission == EMISSION_SAMPLE {
                landing_bounds(&inputs, wavelengths, args.atomics("map"));
            } else {
                photon_trace(&inputs, wavelengths, queue, args.atomics("map"), args.atomics("ledger"));
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
    /// Band x material where photons land.
    pub bands: &'a [Band],
    /// Band x material that photons go through.
    pub optics: &'a [Optics],
    /// First surface from the light.
    pub entry_visibility: TextureView<'a>,
    /// First back face of glass from the light.
    pub exit_visibility: TextureView<'a>,
    /// First opaque surface from the light behind the front of the glass.
    pub landing_visibility: TextureView<'a>,
}

/// One texel's flux at one wavelength.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Photon {
    /// `END_*`.
    pub end: u32,
    /// Before anything.
    pub aimed: u32,
    /// What is left at the end.
    pub flux: u32,
    /// At the entry.
    pub reflected: u32,
    /// At the exit.
    pub kept_inside: u32,
    /// On the way.
    pub absorbed: u32,
    /// Put down away from the surface.
    pub astray: bool,
    /// Put down beside the surface.
    pub beside: bool,
}

/// What a photon leaves in the map, and where.
#[derive(Clone, Copy)]
pub struct Deposit {
    /// In the map.
    pub at: Located,
    /// XYZ.
    pub flux: [u32; 3],
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

struct Landing {
    end: u32,
    at: Located,
    /// What is lit; [`NOTHING`] where nothing is.
    visible: u32,
    distance: f32,
    astray: bool,
    beside: bool,
}

/// CPU mirror: `wavelengths` photons per texel, in tiles of the whole emission view or of the queue if there is one.
pub fn photon_trace(
    inputs: &Inputs<'_>,
    wavelengths: u32,
    queue: Option<&[AtomicU32]>,
    map: &[AtomicU32],
    ledger: &[AtomicU32],
) {
    let size = inputs.views[inputs.params.emission_view as usize].size;
    let grid = UVec2::new(size.x.div_ceil(TILE), size.y.div_ceil(TILE));
    let queued = queue.map(|queue| {
        let count = queue[QUEUE_COUNT].load(Ordering::Relaxed) as usize;
        &queue[QUEUE_HEAD..QUEUE_HEAD + count]
    });
    let tiles = queued.map_or(grid.x * grid.y, |tiles| tiles.len() as u32);
    for band in 0..wavelengths {
        (0..tiles.div_ceil(grid.x)).into_par_iter().for_each(|row| {
            let mut sums = [(0u64, 0u32); LEDGER_ROWS];
            for i in row * grid.x..tiles.min((row + 1) * grid.x) {
                let tile = queued.map_or(UVec2::new(i % grid.x, i / grid.x), |tiles| {
                    queue_cell(tiles[i as usize].load(Ordering::Relaxed))
                });
                inputs.trace_tile(TILE * tile, size, band, map, &mut sums);
            }
            for (row, (flux, photons)) in sums.into_iter().enumerate() {
                let index = LEDGER_WORDS * (LEDGER_ROWS * (inputs.params.first_ledger + band) as usize + row);
                add_64(&ledger[index..index + 2], flux);
                ledger[index + 2].fetch_add(photons, Ordering::Relaxed);
            }
        });
    }
}

/// CPU mirror of [`EMISSION_SAMPLE`].
pub fn landing_bounds(inputs: &Inputs<'_>, wavelengths: u32, bounds: &[AtomicU32]) {
    let size = inputs.views[inputs.params.emission_view as usize].size;
    let stride = inputs.params.sample_stride;
    let along = |first: u32, texels: u32| (first..texels).step_by(stride as usize);
    for band in 0..wavelengths {
        // Another texel of each square at each wavelength.
        let place = (7 * band + 10) % (stride * stride);
        let (x, y) = (place % stride, place / stride);
        along(y, size.y).collect::<Vec<_>>().into_par_iter().for_each(|y| {
            for deposit in along(x, size.x).filter_map(|x| inputs.trace(UVec2::new(x, y), band).1) {
                let at = deposit.at;
                let size = inputs.views[at.view as usize].size;
                let texel = at.texel.as_uvec2().min(size - 1);
                let from = [size.x - texel.x, texel.x + 1, size.y - texel.y, texel.y + 1];
                for (word, from) in bounds[BOUNDS_WORDS * at.face as usize..].iter().zip(from) {
                    word.fetch_max(from, Ordering::Relaxed);
                }
            }
        });
    }
}

/// The photons of a workgroup that leave something in the map, by their places in it.
type Tile = [Option<Deposit>; (TILE * TILE) as usize];

/// The shorter of the steps from `own` to its two neighbours along x or y, texels of the map; `None` where no neighbour
/// belongs to the same beam.
fn step_to_neighbour(tile: &Tile, own: &Located, place: u32, along_y: bool) -> Option<Vec2> {
    let (index, stride) = if along_y { (place / TILE, TILE) } else { (place % TILE, 1) };
    let before = (index > 0).then(|| place - stride);
    let after = (index + 1 < TILE).then(|| place + stride);
    let step = |other: u32| {
        let deposit = tile[other as usize].filter(|d| d.at.face == own.face)?;
        let step = deposit.at.texel - own.texel;
        (step.length_squared() < FARTHEST_NEIGHBOUR * FARTHEST_NEIGHBOUR).then_some(step)
    };
    match (before.and_then(step), after.and_then(step)) {
        (Some(a), Some(b)) => Some(if b.length_squared() < a.length_squared() { b } else { a }),
        (a, b) => a.or(b),
    }
}

impl Photon {
    fn absorb(&mut self, passes: f32) {
        let passed = flux_part(self.flux, part_from(passes));
        self.absorbed += self.flux - passed;
        self.flux = passed;
    }

    /// Flux and photons that a row of the ledger counts.
    fn entry_of_row(&self, row: usize) -> (u32, u32) {
        let of = |flux: u32| (flux, u32::from(flux != 0));
        match row {
            LEDGER_AIMED => (self.aimed, 1),
            LEDGER_EMITTED if self.end != END_MISSED && self.end != END_BLOCKED => (self.aimed, 1),
            LEDGER_EMITTED => (0, 0),
            LEDGER_REFLECTED => of(self.reflected),
            LEDGER_KEPT_INSIDE => of(self.kept_inside),
            LEDGER_ABSORBED => of(self.absorbed),
            LEDGER_ASTRAY if self.astray => (self.flux, 1),
            LEDGER_BESIDE if self.beside => (self.flux, 1),
            _ if row == LEDGER_FIRST_END + self.end as usize => (self.flux, 1),
            _ => (0, 0),
        }
    }
}

impl Inputs<'_> {
    /// The photons of a workgroup.
    fn trace_tile(
        &self,
        first: UVec2,
        size: UVec2,
        band: u32,
        map: &[AtomicU32],
        sums: &mut [(u64, u32); LEDGER_ROWS],
    ) {
        let mut tile: Tile = [None; (TILE * TILE) as usize];
        for place in 0..TILE * TILE {
            let texel = first + UVec2::new(place % TILE, place / TILE);
            if texel.x >= size.x || texel.y >= size.y {
                continue;
            }
            let (photon, deposit) = self.trace(texel, band);
            tile[place as usize] = deposit;
            for (row, sum) in sums.iter_mut().enumerate() {
                let (flux, photons) = photon.entry_of_row(row);
                sum.0 += u64::from(flux);
                sum.1 += photons;
            }
        }
        for place in 0..TILE * TILE {
            if let Some(deposit) = &tile[place as usize] {
                let (reach, sigma) = self.splat_shape(&tile, &deposit.at, place);
                splat(self.views, &deposit.at, deposit.flux, reach, sigma, map);
            }
        }
    }

    /// Reach and standard deviation of a photon's splat along x and y: as wide as its beam, told from where its neighbours
    /// land.
    fn splat_shape(&self, tile: &Tile, own: &Located, place: u32) -> (UVec2, Vec2) {
        let params = &self.params;
        if params.splat_share == 0.0 {
            return (UVec2::splat(params.splat_taps), Vec2::splat(params.splat_sigma));
        }
        let texel_slope = |first: u32| self.views[(first + own.face) as usize].texel_slope;
        let finer = texel_slope(params.landing_view) / texel_slope(params.map_view);
        let spacing = params.splat_spacing * finer;
        let alone = [Vec2::new(spacing.x, 0.0), Vec2::new(0.0, spacing.y)];
        let [a, b] =
            [false, true].map(|y| step_to_neighbour(tile, own, place, y).unwrap_or(alone[usize::from(y)]));
        let width = (a * a + b * b).map(f32::sqrt);
        let most = (params.splat_taps as f32 + REACH_ROUNDING) / REACH_SIGMAS;
        let sigma = (params.splat_share * width).clamp(Vec2::splat(params.splat_sigma), Vec2::splat(most));
        ((REACH_SIGMAS * sigma - REACH_ROUNDING).ceil().as_uvec2(), sigma)
    }

    /// A place that no surface covers in the view lies where a surface nearby would go on: what arrives there blurs into the
    /// surface as much as what arrives on it blurs out.
    fn beside_surface(&self, at: &Located, ray: Ray, distance: f32) -> u32 {
        let guard = self.params.guard_texels;
        let size = self.views[at.view as usize].size.as_vec2();
        for i in 0..8 {
            let side = i + i / 4; // the eight places round the middle of 3 x 3
            let offset = guard * Vec2::new((side % 3) as f32 - 1.0, (side / 3) as f32 - 1.0);
            let texel = (at.texel + offset).clamp(Vec2::ZERO, size - 1.0).as_uvec2();
            let visible = visible_in_layer(&self.landing_visibility, texel, at.face);
            if visible != NOTHING {
                let hit = self.triangles[visible as usize - 1].plane_hit(ray);
                if hit.crosses && (hit.distance - distance).abs() <= 0.01 * distance + SAME_SURFACE {
                    return visible;
                }
            }
        }
        NOTHING
    }

    /// Where a ray that has entered a refractor leaves it by the back faces that the light sees, or one in a hollow mirror meets
    /// its lit faces.
    fn find_exit(&self, view: &View, inside: Inside<'_>) -> Option<Exit> {
        let reflected = self.params.path == PATH_REFLECTED;
        let faces = if reflected { &self.entry_visibility } else { &self.exit_visibility };
        inside.find_exit(view, self.params.exit_reach, self.params.exit_iterations, |texel| {
            faces.load_uint(texel.x, texel.y)
        })
    }

    /// What the map's view shows where it sees a point; where that is nothing, what it shows of the receivers' middle.
    fn landing_triangle(&self, at: &Located) -> u32 {
        let visible = visible_in_layer(&self.landing_visibility, at.texel.as_uvec2(), at.face);
        if visible != NOTHING {
            return visible;
        }
        let params = &self.params;
        let middle =
            locate_clamped(self.views, params.landing_view, params.landing_faces, params.landing_center);
        visible_in_layer(&self.landing_visibility, middle.texel.as_uvec2(), middle.face)
    }

    /// Shah's rayGeo: project the guess into the light's view, see what surface is there, guess again.
    fn find_landing(&self, ray: Ray) -> Landing {
        let params = &self.params;
        let mut distance = (params.landing_center - ray.origin).dot(ray.direction).max(0.0);
        let mut last = NOTHING;
        for _ in 0..params.landing_iterations {
            let guess = ray.origin + distance * ray.direction;
            let at = locate_clamped(self.views, params.landing_view, params.landing_faces, guess);
            let visible = if at.found { self.landing_triangle(&at) } else { NOTHING };
            if visible == NOTHING {
                distance *= 0.5;
                continue;
            }
            let triangle = &self.triangles[visible as usize - 1];
            let ahead = triangle.plane_hit(ray);
            if params.landing_update == LANDING_PLANE && ahead.crosses && ahead.distance >= 0.0 {
                distance = ahead.distance;
                if visible == last {
                    break; // the same plane again
                }
                last = visible;
                continue;
            }
            let light_ray = self.views[at.view as usize].ray_through(guess);
            let below = triangle.plane_hit(light_ray);
            if below.crosses {
                distance = (light_ray.origin + below.distance * light_ray.direction - ray.origin).length();
            }
        }
        let point = ray.origin + distance * ray.direction;
        let at = locate(self.views, params.landing_view, params.landing_faces, point);
        let ended = |end| Landing { end, at, visible: NOTHING, distance, astray: false, beside: false };
        if !at.found {
            return ended(END_OUTSIDE_MAP);
        }
        let visible = visible_in_layer(&self.landing_visibility, at.texel.as_uvec2(), at.face);
        if visible == NOTHING {
            let near =
                if params.guard_texels > 0.0 { self.beside_surface(&at, ray, distance) } else { NOTHING };
            return Landing { visible: near, beside: near != NOTHING, ..ended(END_OUTSIDE_MAP) };
        }
        let triangle = &self.triangles[visible as usize - 1];
        // What GLSL's refract() makes of total reflection goes nowhere: it stays under the place where it happened.
        if ray.direction == Vec3::ZERO {
            return Landing { visible, distance: 0.0, astray: true, ..ended(END_LANDED) };
        }
        let hit = triangle.plane_hit(ray);
        if !hit.crosses || hit.distance < -SAME_SURFACE {
            return ended(END_ESCAPED);
        }
        let light_hit = triangle.plane_hit(self.views[at.view as usize].ray_through(point));
        if hit.facing * light_hit.facing <= 0.0 {
            return ended(END_OUTSIDE_MAP);
        }
        let astray = (hit.distance - distance).abs() > 0.01 * distance + SAME_SURFACE;
        Landing { visible, astray, ..ended(END_LANDED) }
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
        self.optics[((self.params.first_band + band) * self.params.materials + front.material) as usize]
    }

    /// Into glass, and out again if it has a back face.
    fn refracted(&self, photon: &mut Photon, view: &View, light_ray: Ray, entry: &Entry, band: u32) -> Way {
        let params = &self.params;
        let front = &self.triangles[entry.triangle as usize];
        let hit = entry.hit;
        let medium = self.medium(front, band);
        let entering = hit.facing < 0.0;
        let eta = if entering { medium.index } else { 1.0 / medium.index };
        let first = cross_surface(light_ray.direction, lit_normal(front, &hit), front, eta, params.rule);
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
        let second = cross_surface(ray.direction, normal, back, 1.0 / medium.index, params.rule);
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
            interface_reflectance(light_ray.direction, normal, eta, self.params.rule)
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
    pub fn trace(&self, texel: UVec2, band: u32) -> (Photon, Option<Deposit>) {
        let params = &self.params;
        let view = &self.views[params.emission_view as usize];
        let light_ray = view.ray(texel.as_vec2() + 0.5);
        let falloff =
            spot_falloff(light_ray.direction, params.spot_axis, params.spot_scale, params.spot_offset);
        let aimed = (QUANTUM * view.texel_measure(texel) * falloff + 0.5) as u32;
        let mut photon = Photon {
            end: END_MISSED,
            aimed,
            flux: aimed,
            reflected: 0,
            kept_inside: 0,
            absorbed: 0,
            astray: false,
            beside: false,
        };

        let Some(Entry { triangle, hit }) = self.entry_at(view, texel, light_ray) else {
            return (photon, None);
        };
        let front = &self.triangles[triangle as usize];
        if front.flags & params.casters == 0 {
            let shows_glass = || self.exit_visibility.load_uint(texel.x, texel.y) != NOTHING;
            if front.flags & TRIANGLE_REFRACTS == 0 && shows_glass() {
                photon.end = END_BLOCKED;
            }
            return (photon, None);
        }
        if !hit.crosses || (params.range > 0.0 && hit.distance > params.range) {
            return (photon, None);
        }

        photon.end = END_LANDED;
        let entry = Entry { triangle, hit };
        let Way { ray, absorption } = if params.path == PATH_REFLECTED {
            self.reflected(&mut photon, view, light_ray, &entry, band)
        } else {
            self.refracted(&mut photon, view, light_ray, &entry, band)
        };
        if photon.end != END_LANDED {
            return (photon, None);
        }

        let landing = self.find_landing(ray);
        photon.end = landing.end;
        if landing.end != END_LANDED && !landing.beside {
            return (photon, None);
        }
        let point = ray.origin + landing.distance * ray.direction;
        let at = on_map(self.views, landing.at, params.landing_view, params.map_view, point);
        if !at.found {
            photon.end = END_OUTSIDE_MAP;
            return (photon, None);
        }
        photon.astray = landing.astray;
        photon.beside = landing.beside;
        photon.absorb((-absorption * landing.distance).exp());
        let lit = self.triangles[landing.visible as usize - 1].material;
        let weight = self.bands[((params.first_band + band) * params.materials + lit) as usize].weight;
        let flux = weight.map(|w| flux_part(photon.flux, w));
        (photon, Some(Deposit { at, flux }))
    }
}
