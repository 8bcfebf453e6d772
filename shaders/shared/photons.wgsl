// Photons of a light, one per texel of its emission view and wavelength, in tiles of 8 x 8: where they start, and what they leave in the
// map and in the books. Host side: asm-core's `shared/photons.rs`.
//
// band      one wavelength of one light
//
// Expects the globals `params.photons`, `triangles`, `views`, `bands`, `queue`, `map` and `ledger`.

struct Photons {
    emission_view: u32,
    landing_view: u32,
    landing_faces: u32,
    map_view: u32,             // first of the map's, one per view of where light may land
    first_band: u32,           // first row of this light, in `bands` and `optics`
    materials: u32,            // row length of `bands` and `optics`
    first_ledger: u32,         // first row of this light and path, in `ledger`
    emission: u32,             // EMISSION_*
    sample_stride: u32,        // of EMISSION_SAMPLE
    max_groups: u32,           // of the device, per dimension
    path: u32,                 // PATH_*
    casters: u32,              // TRIANGLE_* of the surfaces that photons of this path follow
    rule: u32,                 // RULE_*
    landing_iterations: u32,
    landing_update: u32,       // LANDING_*
    splat_taps: u32,           // texels to each side of the landing's, 0 is a point; the most where splats follow the spacing
    landing_center: vec3<f32>, // of the receivers' bounds
    range: f32,                // light beyond this distance is dark; 0 has no end
    spot_axis: vec3<f32>,
    spot_scale: f32,           // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_offset: f32,
    splat_sigma: f32,          // standard deviation, texels; the least where splats follow the spacing
    splat_share: f32,          // standard deviation over the distance to the next photon; 0 keeps splat_sigma
    guard_texels: f32,         // photons that arrive up to so many texels beside a surface are put down too
    splat_spacing: vec2<f32>,  // between photons that nothing bends, texels of the landing view
    reserved0: u32,
    reserved1: u32,
}

const EMISSION_GRID: u32 = 0u;   // tiles of the whole emission view
const EMISSION_QUEUE: u32 = 1u;  // tiles that `queue` holds
const EMISSION_SAMPLE: u32 = 2u; // one texel in `sample_stride` along each side, and `map` holds only where they land

// Photons at one wavelength where they land on one material.
struct Band {
    weight: vec3<u32>, // XYZ as parts, see flux.wgsl
    reserved: u32,
}

struct Photon {
    end: u32,         // END_*, or NO_END
    aimed: u32,
    flux: u32,        // what is left at the end
    reflected: u32,
    kept_inside: u32,
    absorbed: u32,
    astray: bool,
    beside: bool,
}

// Of what is not there: no row of the ledger counts it.
const NO_END: u32 = 8u; // LEDGER_ROWS - LEDGER_FIRST_END

// What a photon leaves in the map, and where.
struct Traced {
    photon: Photon,
    deposits: bool,
    at: Located,
    deposit: vec3<u32>, // XYZ
}

// A photon that leaves nothing.
fn leaves_nothing(photon: Photon) -> Traced {
    return Traced(photon, false, Located(false, 0u, 0u, vec2<f32>(0.0)), vec3<u32>(0u));
}

// Before it meets anything.
fn emitted(view: View, texel: vec2<u32>, light_ray: Ray) -> Photon {
    let falloff = spot_falloff(light_ray.direction, params.photons.spot_axis, params.photons.spot_scale, params.photons.spot_offset);
    let aimed = u32(QUANTUM * view_texel_measure(view, texel) * falloff + 0.5);
    return Photon(END_MISSED, aimed, aimed, 0u, 0u, 0u, false, false);
}

fn absorb(photon: Photon, passes: f32) -> Photon {
    var after = photon;
    after.flux = flux_part(photon.flux, part_from(passes));
    after.absorbed += photon.flux - after.flux;
    return after;
}

// A photon that arrives at a point of a surface, `at` being that in the landing views.
fn put_down(photon: Photon, at: Located, point: vec3<f32>, visible: u32, band: u32) -> Traced {
    let place = on_map(at, params.photons.landing_view, params.photons.map_view, point);
    if !place.found {
        var beyond = photon;
        beyond.end = END_OUTSIDE_MAP;
        beyond.beside = false;
        return leaves_nothing(beyond);
    }
    let material = triangles[visible - 1u].material;
    let weight = bands[(params.photons.first_band + band) * params.photons.materials + material].weight;
    let deposit = vec3<u32>(
        flux_part(photon.flux, weight.x),
        flux_part(photon.flux, weight.y),
        flux_part(photon.flux, weight.z),
    );
    return Traced(photon, true, place, deposit);
}

// Which texel of each square of `sample_stride` texels along each side is traced: another one at each wavelength.
fn sampled_texel(band: u32) -> vec2<u32> {
    let stride = params.photons.sample_stride;
    let place = (7u * band + 10u) % (stride * stride);
    return vec2<u32>(place % stride, place / stride);
}

const TILE: u32 = 8u;     // photons along each side of a workgroup
const PHOTONS: u32 = 64u; // per workgroup

struct PhotonStart {
    exists: bool,
    texel: vec2<u32>,
}

// Which photon an invocation traces.
fn photon_start(group: vec3<u32>, in_tile: vec2<u32>) -> PhotonStart {
    var tile = group.xy;
    var exists = true;
    if params.photons.emission == EMISSION_QUEUE {
        let i = queue_row(group, params.photons.max_groups);
        exists = i < queue[QUEUE_COUNT];
        if exists {
            tile = queue_cell(queue[QUEUE_HEAD + i]);
        }
    }
    var texel = TILE * tile + in_tile;
    if params.photons.emission == EMISSION_SAMPLE {
        texel = params.photons.sample_stride * texel + sampled_texel(group.z);
    }
    return PhotonStart(exists && all(texel < views[params.photons.emission_view].size), texel);
}

// Most of how far the landings lie from the right, the left, the bottom and the top of a face, in whole texels.
fn landing_bounds_add(at: Located) {
    let size = views[at.view].size;
    let texel = min(vec2<u32>(at.texel), size - 1u);
    let reach = vec4<u32>(size.x - texel.x, texel.x + 1u, size.y - texel.y, texel.y + 1u);
    for (var i = 0u; i < 4u; i++) {
        let word = 4u * at.face + i;
        // Nearly always false, and cheaper than to fight for the word.
        if reach[i] > atomicLoad(&map[word]) {
            atomicMax(&map[word], reach[i]);
        }
    }
}

// Two landings farther apart than this, texels, do not belong to one beam.
const FARTHEST_NEIGHBOUR: f32 = 16.0;

// Standard deviations that a splat reaches at least, but for this part of a texel.
const REACH_SIGMAS: f32 = 2.5;
const REACH_ROUNDING: f32 = 0.25;

var<workgroup> ends: array<u32, PHOTONS>;              // END_*, NO_END, or LEDGER_ROWS beside the grid
var<workgroup> fluxes: array<vec4<u32>, PHOTONS>;      // aimed, reflected, kept inside, absorbed
var<workgroup> remaining: array<vec3<u32>, PHOTONS>;   // left at the end, astray, beside
var<workgroup> places: array<vec3<f32>, PHOTONS>;      // texel of the map; its face, below 0 where nothing was left

// Shows the workgroup what became of a photon.
fn show(local: u32, exists: bool, left: Traced) {
    let photon = left.photon;
    ends[local] = select(LEDGER_ROWS, photon.end, exists);
    fluxes[local] = vec4<u32>(photon.aimed, photon.reflected, photon.kept_inside, photon.absorbed);
    remaining[local] = vec3<u32>(photon.flux, u32(photon.astray), u32(photon.beside));
    places[local] = vec3<f32>(left.at.texel, select(-1.0, f32(left.at.face), left.deposits));
}

// Step from `own` to a neighbour's landing; longer than any that counts where the two do not belong to one beam.
fn step_to(own: vec3<f32>, other: u32, exists: bool) -> vec2<f32> {
    if !exists || places[other].z != own.z {
        return vec2<f32>(2.0 * FARTHEST_NEIGHBOUR);
    }
    return places[other].xy - own.xy;
}

// The shorter of the steps to the two neighbours along x or y, or `alone`.
fn step_to_neighbour(own: vec3<f32>, index: u32, place: u32, stride: u32, alone: vec2<f32>) -> vec2<f32> {
    let before = step_to(own, max(place, stride) - stride, index > 0u);
    let after = step_to(own, min(place + stride, PHOTONS - 1u), index + 1u < TILE);
    let shorter = select(before, after, dot(after, after) < dot(before, before));
    return select(alone, shorter, dot(shorter, shorter) < FARTHEST_NEIGHBOUR * FARTHEST_NEIGHBOUR);
}

// Standard deviation of a photon's splat along x and y: as wide as its beam, told from where its neighbours land.
fn splat_sigma(place: u32) -> vec2<f32> {
    let own = places[place];
    let face = u32(own.z);
    let finer = views[params.photons.landing_view + face].texel_slope / views[params.photons.map_view + face].texel_slope;
    let spacing = params.photons.splat_spacing * finer;
    let a = step_to_neighbour(own, place % TILE, place, 1u, vec2<f32>(spacing.x, 0.0));
    let b = step_to_neighbour(own, place / TILE, place, TILE, vec2<f32>(0.0, spacing.y));
    let most = (f32(params.photons.splat_taps) + REACH_ROUNDING) / REACH_SIGMAS;
    return clamp(params.photons.splat_share * sqrt(a * a + b * b), vec2<f32>(params.photons.splat_sigma), vec2<f32>(most));
}

// Adds what a photon leaves to the map, once the workgroup has seen all of them.
fn lay_down(local: u32, left: Traced) {
    if !left.deposits {
        return;
    }
    var sigma = vec2<f32>(params.photons.splat_sigma);
    var reach = vec2<u32>(params.photons.splat_taps);
    if params.photons.splat_share != 0.0 {
        sigma = splat_sigma(local);
        reach = vec2<u32>(ceil(REACH_SIGMAS * sigma - REACH_ROUNDING));
    }
    splat(left.at, left.deposit, reach, sigma);
}

// Flux and photons of a workgroup in a row of the ledger.
struct RowSum {
    low: u32,
    high: u32,
    photons: u32,
}

// Flux and photons that a row counts; what follows the first arrival of a photon sets out no more.
fn entry_of_row(row: u32, i: u32, first: bool) -> vec2<u32> {
    let end = ends[i];
    if end == LEDGER_ROWS {
        return vec2<u32>(0u);
    }
    switch row {
        case LEDGER_AIMED: {
            return select(vec2<u32>(0u), vec2<u32>(fluxes[i].x, 1u), first);
        }
        case LEDGER_EMITTED: {
            let meets_caster = end != END_MISSED && end != END_BLOCKED;
            return select(vec2<u32>(0u), vec2<u32>(fluxes[i].x, 1u), first && meets_caster);
        }
        case LEDGER_REFLECTED: {
            return vec2<u32>(fluxes[i].y, u32(fluxes[i].y != 0u));
        }
        case LEDGER_KEPT_INSIDE: {
            return vec2<u32>(fluxes[i].z, u32(fluxes[i].z != 0u));
        }
        case LEDGER_ABSORBED: {
            return vec2<u32>(fluxes[i].w, u32(fluxes[i].w != 0u));
        }
        case LEDGER_ASTRAY: {
            return vec2<u32>(remaining[i].x, 1u) * remaining[i].y;
        }
        case LEDGER_BESIDE: {
            return vec2<u32>(remaining[i].x, 1u) * remaining[i].z;
        }
        default: {
            return select(vec2<u32>(0u), vec2<u32>(remaining[i].x, 1u), end == row - LEDGER_FIRST_END);
        }
    }
}

// Adds what the workgroup has seen to the sum of a row.
fn count_row(row: u32, first: bool, before: RowSum) -> RowSum {
    var sum = before;
    for (var i = 0u; i < PHOTONS; i++) {
        let entry = entry_of_row(row, i, first);
        sum.low += entry.x;
        if sum.low < entry.x {
            sum.high += 1u;
        }
        sum.photons += entry.y;
    }
    return sum;
}

fn book_row(row: u32, band: u32, sum: RowSum) {
    let index = LEDGER_WORDS * (LEDGER_ROWS * (params.photons.first_ledger + band) + row);
    var high = sum.high;
    let before = atomicAdd(&ledger[index], sum.low);
    if before + sum.low < sum.low {
        high += 1u;
    }
    if high != 0u {
        atomicAdd(&ledger[index + 1u], high);
    }
    if sum.photons != 0u {
        atomicAdd(&ledger[index + 2u], sum.photons);
    }
}
