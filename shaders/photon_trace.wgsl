// Caustics mapping (Shah et al.), one photon per texel of the light's emission view and wavelength, in tiles of 8 x 8: refract
// at the entry, find and refract at the exit, or reflect at the first surface; find the landing, add the flux to the map. Host side: `passes/photon_trace.rs`.
//
// path      what photons do where the light meets glass or a mirror first: go in, or go back
// band      one wavelength of one light
// entry     where the light meets glass first
// exit      where it leaves the same glass again
// landing   where it meets an opaque surface

struct PhotonTrace {
    emission_view: u32,
    landing_view: u32,
    landing_faces: u32,
    first_band: u32,          // first row of this light, in `bands` and `optics`
    materials: u32,           // row length of `bands` and `optics`
    interfaces: u32,          // 1: only the entry refracts (Shah); 2: the exit too
    exit_iterations: u32,
    landing_iterations: u32,
    landing_update: u32,      // LANDING_*
    splat_taps: u32,          // texels to each side of the landing's, 0 is a point; the most where splats follow the spacing
    splat_sigma: f32,         // standard deviation, texels; the least where splats follow the spacing
    exit_reach: f32,          // no way through glass is longer
    landing_center: vec3<f32>, // of the receivers' bounds
    range: f32,               // light beyond this distance is dark; 0 has no end
    spot_axis: vec3<f32>,
    spot_scale: f32,          // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_offset: f32,
    splat_share: f32,         // standard deviation over the distance to the next photon; 0 keeps splat_sigma
    splat_spacing: vec2<f32>, // between photons that nothing bends, texels of the landing view
    guard_texels: f32,        // photons that arrive up to so many texels beside a surface are put down too
    emission: u32,            // EMISSION_*
    max_groups: u32,          // of the device, per dimension
    rule: u32,                // RULE_*
    path: u32,                // PATH_*
    casters: u32,             // TRIANGLE_* of the surfaces that photons of this path follow
    first_ledger: u32,        // first row of this light and path, in `ledger`
    map_view: u32,            // first of the map's, one per view of where light may land
    sample_stride: u32,       // of EMISSION_SAMPLE
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

const EMISSION_GRID: u32 = 0u;  // tiles of the whole emission view
const EMISSION_QUEUE: u32 = 1u; // tiles that `queue` holds
const EMISSION_SAMPLE: u32 = 2u; // one texel in `sample_stride` along each side, and `map` holds only where they land

const LANDING_DISTANCE: u32 = 0u; // Shah's update: the distance of the surface point below the last guess
const LANDING_PLANE: u32 = 1u;    // the ray against the plane of the triangle below the last guess

// Photons at one wavelength where they land on one material.
struct Band {
    weight: vec3<u32>, // XYZ as parts, see flux.wgsl
    reserved: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonTrace;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> bands: array<Band>; // band * materials + material where it lands
@group(0) @binding(4) var<storage, read> optics: array<Optics>; // band * materials + material it goes through
@group(0) @binding(5) var entry_visibility: texture_2d<u32>;
@group(0) @binding(6) var exit_visibility: texture_2d<u32>;
@group(0) @binding(7) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(8) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> ledger: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read> queue: array<u32>;

struct Photon {
    end: u32,         // END_*
    aimed: u32,
    flux: u32,        // what is left at the end
    reflected: u32,
    kept_inside: u32,
    absorbed: u32,
    astray: bool,
    beside: bool,
}

// What a photon leaves in the map, and where.
struct Traced {
    photon: Photon,
    deposits: bool,
    at: Located,
    deposit: vec3<u32>, // XYZ
}

fn face_at(texel: vec2<i32>) -> u32 {
    if params.path == PATH_REFLECTED {
        return textureLoad(entry_visibility, texel, 0).r;
    }
    return textureLoad(exit_visibility, texel, 0).r;
}

// Where a ray that has entered `object` leaves it by the back faces that the light sees, or one in what `object` encloses
// meets its lit faces.
fn find_exit(view: View, ray: Ray, object: u32, side: f32) -> ExitSearch {
    var search = exit_search(params.exit_reach, side);
    for (var i = 0u; i < params.exit_iterations && !search.done; i++) {
        let texel = view_texel(view, ray.origin + search.distance * ray.direction);
        search = exit_search_step(search, face_at(texel), ray, object);
    }
    if exit_search_is_close(search) {
        let texel = view_texel(view, ray.origin + search.hit.distance * ray.direction);
        for (var i = 0; i < 8; i++) {
            search = exit_search_beside(search, face_at(texel_beside(view, texel, i)), ray, object);
        }
    }
    return search;
}

struct Landing {
    end: u32, // END_LANDED, END_OUTSIDE_MAP or END_ESCAPED
    at: Located,
    visible: u32, // what is lit; NOTHING where nothing is
    distance: f32,
    astray: bool,
    beside: bool, // END_OUTSIDE_MAP, but to be put down
}

// What the map's view shows where it sees a point; where that is nothing, what it shows of the receivers' middle.
fn landing_triangle(at: Located) -> u32 {
    let visible = textureLoad(landing_visibility, vec2<i32>(at.texel), i32(at.face), 0).r;
    if visible != NOTHING {
        return visible;
    }
    let middle = locate_clamped(params.landing_view, params.landing_faces, params.landing_center);
    return textureLoad(landing_visibility, vec2<i32>(middle.texel), i32(middle.face), 0).r;
}

// A place that no surface covers in the view lies where a surface nearby would go on: what arrives there blurs into the
// surface as much as what arrives on it blurs out.
fn beside_surface(at: Located, ray: Ray, distance: f32) -> u32 {
    let size = vec2<f32>(views[at.view].size);
    for (var i = 0u; i < 8u; i++) {
        let side = i + i / 4u; // the eight places round the middle of 3 x 3
        let offset = params.guard_texels * vec2<f32>(f32(side % 3u) - 1.0, f32(side / 3u) - 1.0);
        let texel = clamp(at.texel + offset, vec2<f32>(0.0), size - 1.0);
        let visible = textureLoad(landing_visibility, vec2<i32>(texel), i32(at.face), 0).r;
        if visible != NOTHING {
            let hit = plane_hit(triangles[visible - 1u], ray);
            if hit.crosses && abs(hit.distance - distance) <= 0.01 * distance + SAME_SURFACE {
                return visible;
            }
        }
    }
    return NOTHING;
}

// Shah's rayGeo: project the guess into the light's view, see what surface is there, guess again.
fn find_landing(ray: Ray) -> Landing {
    var distance = max(dot(params.landing_center - ray.origin, ray.direction), 0.0);
    var last = NOTHING;
    for (var i = 0u; i < params.landing_iterations; i++) {
        let guess = ray.origin + distance * ray.direction;
        let at = locate_clamped(params.landing_view, params.landing_faces, guess);
        var visible = NOTHING;
        if at.found {
            visible = landing_triangle(at);
        }
        if visible == NOTHING {
            distance *= 0.5;
            continue;
        }
        let ahead = plane_hit(triangles[visible - 1u], ray);
        if params.landing_update == LANDING_PLANE && ahead.crosses && ahead.distance >= 0.0 {
            distance = ahead.distance;
            if visible == last {
                break; // the same plane again
            }
            last = visible;
            continue;
        }
        let light_ray = view_ray_through(views[at.view], guess);
        let below = plane_hit(triangles[visible - 1u], light_ray);
        if below.crosses {
            distance = length(light_ray.origin + below.distance * light_ray.direction - ray.origin);
        }
    }
    let point = ray.origin + distance * ray.direction;
    let at = locate(params.landing_view, params.landing_faces, point);
    if !at.found {
        return Landing(END_OUTSIDE_MAP, at, NOTHING, distance, false, false);
    }
    let visible = textureLoad(landing_visibility, vec2<i32>(at.texel), i32(at.face), 0).r;
    if visible == NOTHING {
        var near = NOTHING;
        if params.guard_texels > 0.0 {
            near = beside_surface(at, ray, distance);
        }
        return Landing(END_OUTSIDE_MAP, at, near, distance, false, near != NOTHING);
    }
    // What GLSL's refract() makes of total reflection goes nowhere: it stays under the place where it happened.
    if all(ray.direction == vec3<f32>(0.0)) {
        return Landing(END_LANDED, at, visible, 0.0, true, false);
    }
    let hit = plane_hit(triangles[visible - 1u], ray);
    if !hit.crosses || hit.distance < -SAME_SURFACE {
        return Landing(END_ESCAPED, at, NOTHING, distance, false, false);
    }
    let light_hit = plane_hit(triangles[visible - 1u], view_ray_through(views[at.view], point));
    if hit.facing * light_hit.facing <= 0.0 {
        return Landing(END_OUTSIDE_MAP, at, NOTHING, distance, false, false);
    }
    let astray = abs(hit.distance - distance) > 0.01 * distance + SAME_SURFACE;
    return Landing(END_LANDED, at, visible, distance, astray, false);
}

// What a photon meets first.
struct Entry {
    visible: u32,
    hit: PlaneHit,
}

// Rasterisers round corners to parts of a texel, each in its own way: a texel's centre may lie just beside the triangle that
// it shows, or on an edge. The photon then enters by the triangle round about that its ray meets, whoever drew the view.
fn entry_at(view: View, texel: vec2<i32>, ray: Ray) -> Entry {
    var entry = Entry(textureLoad(entry_visibility, texel, 0).r, PlaneHit(false, 0.0, 0.0, 0.0, 0.0));
    if entry.visible == NOTHING {
        return entry;
    }
    entry.hit = plane_hit(triangles[entry.visible - 1u], ray);
    if well_inside(entry.hit) {
        return entry;
    }
    for (var i = 0; i < 8; i++) {
        let visible = textureLoad(entry_visibility, texel_beside(view, texel, i), 0).r;
        if visible != NOTHING {
            let hit = plane_hit(triangles[visible - 1u], ray);
            if preferred(hit, visible, entry.hit, entry.visible) {
                entry = Entry(visible, hit);
            }
        }
    }
    return entry;
}

fn absorb(photon: Photon, passes: f32) -> Photon {
    var after = photon;
    after.flux = flux_part(photon.flux, part_from(passes));
    after.absorbed += photon.flux - after.flux;
    return after;
}

// A photon behind all surfaces that it meets, END_LANDED if it goes on.
struct Way {
    photon: Photon,
    ray: Ray,
    absorption: f32, // on the way to the landing, per working unit
}

fn medium_of(front: Triangle, band: u32) -> Optics {
    return optics[(params.first_band + band) * params.materials + front.material];
}

// Normal of the side that the light comes from.
fn lit_normal(front: Triangle, hit: PlaneHit) -> vec3<f32> {
    return select(-1.0, 1.0, hit.facing < 0.0) * interpolated_normal(front, hit);
}

// Into glass, and out again if it has a back face.
fn refracted(emitted: Photon, view: View, light_ray: Ray, entry: Entry, band: u32) -> Way {
    let front = triangles[entry.visible - 1u];
    let hit = entry.hit;
    let medium = medium_of(front, band);
    let entering = hit.facing < 0.0;
    let eta = select(1.0 / medium.index, medium.index, entering);
    let first = cross_surface(light_ray.direction, lit_normal(front, hit), front, eta, params.rule);
    let ray = Ray(light_ray.origin + hit.distance * light_ray.direction, first.direction);
    var photon = emitted;
    if first.end != END_LANDED {
        photon.end = first.end;
        return Way(photon, ray, 0.0);
    }
    photon.flux = flux_part(emitted.flux, part_from(1.0 - first.reflectance));
    photon.reflected = emitted.flux - photon.flux;
    photon = absorb(photon, medium.surface);
    let open = (front.flags & TRIANGLE_OPEN) != 0u;
    let inside_absorption = select(0.0, medium.absorption, entering && open);
    if !entering || params.interfaces != 2u {
        return Way(photon, ray, inside_absorption);
    }
    let exit = find_exit(view, ray, front.object, EXIT_OF_BODY);
    if !exit.found {
        if !open {
            photon.end = END_NO_EXIT;
        }
        return Way(photon, ray, inside_absorption);
    }
    photon = absorb(photon, exp(-medium.absorption * exit.hit.distance));
    let back = triangles[exit.triangle];
    let second = cross_surface(ray.direction, -interpolated_normal(back, exit.hit), back, 1.0 / medium.index, params.rule);
    if second.end != END_LANDED {
        photon.end = second.end;
        return Way(photon, ray, 0.0);
    }
    let left = flux_part(photon.flux, part_from(1.0 - second.reflectance));
    photon.kept_inside = photon.flux - left;
    photon.flux = left;
    photon = absorb(photon, medium.surface);
    return Way(photon, Ray(ray.origin + exit.hit.distance * ray.direction, second.direction), 0.0);
}

// Reflections at a hollow mirror.
const MOST_REFLECTIONS: u32 = 4u;

// Back from a mirror, or from glass; what goes in is absorbed there, or kept inside.
fn reflected(emitted: Photon, view: View, light_ray: Ray, entry: Entry, band: u32) -> Way {
    let front = triangles[entry.visible - 1u];
    let hit = entry.hit;
    let medium = medium_of(front, band);
    let normal = lit_normal(front, hit);
    let mirror = (front.flags & TRIANGLE_MIRROR) != 0u;
    let outside = hit.facing < 0.0;
    var share = 0.0;
    if mirror {
        share = mirror_reflectance(light_ray.direction, normal, medium.surface);
    } else {
        let eta = select(1.0 / medium.index, medium.index, outside);
        share = interface_reflectance(light_ray.direction, normal, eta, params.rule);
    }
    let back = reflect_at(light_ray.direction, normal, front, share);
    let ray = Ray(light_ray.origin + hit.distance * light_ray.direction, back.direction);
    var photon = emitted;
    if back.end != END_LANDED {
        photon.end = back.end;
        return Way(photon, ray, 0.0);
    }
    photon.flux = flux_part(emitted.flux, part_from(back.reflectance));
    let rest = emitted.flux - photon.flux;
    photon.absorbed = select(0u, rest, mirror);
    photon.kept_inside = select(rest, 0u, mirror);
    if mirror {
        return reflected_on(Way(photon, ray, 0.0), view, front.object, sign(hit.facing), band);
    }
    // Below an open surface it goes on through what the surface encloses.
    return Way(photon, ray, select(medium.absorption, 0.0, outside));
}

// From wall to wall of a hollow mirror, as along the inside of a ring; `side` is -1 where faces are lit on their outside.
fn reflected_on(first: Way, view: View, object: u32, side: f32, band: u32) -> Way {
    var way = first;
    for (var reflections = 1u; true; reflections++) {
        let wall = find_exit(view, way.ray, object, side);
        if !wall.found || !wall.contained {
            break;
        }
        let face = triangles[wall.triangle];
        let normal = -side * interpolated_normal(face, wall.hit);
        let share = mirror_reflectance(way.ray.direction, normal, medium_of(face, band).surface);
        let back = reflect_at(way.ray.direction, normal, face, share);
        if back.end != END_LANDED || reflections == MOST_REFLECTIONS {
            way.photon.end = select(END_NO_EXIT, back.end, back.end != END_LANDED);
            break;
        }
        way.photon = absorb(way.photon, back.reflectance);
        way.ray = Ray(way.ray.origin + wall.hit.distance * way.ray.direction, back.direction);
    }
    return way;
}

// A photon that leaves nothing.
fn traced(photon: Photon) -> Traced {
    return Traced(photon, false, Located(false, 0u, 0u, vec2<f32>(0.0)), vec3<u32>(0u));
}

fn trace(texel: vec2<u32>, band: u32) -> Traced {
    let view = views[params.emission_view];
    let light_ray = view_ray(view, vec2<f32>(texel) + 0.5);
    let falloff = spot_falloff(light_ray.direction, params.spot_axis, params.spot_scale, params.spot_offset);
    let aimed = u32(QUANTUM * view_texel_measure(view, texel) * falloff + 0.5);
    var photon = Photon(END_MISSED, aimed, aimed, 0u, 0u, 0u, false, false);

    let seen = entry_at(view, vec2<i32>(texel), light_ray);
    if seen.visible == NOTHING {
        return traced(photon);
    }
    let front = triangles[seen.visible - 1u];
    if (front.flags & params.casters) == 0u {
        if (front.flags & TRIANGLE_REFRACTS) == 0u && textureLoad(exit_visibility, vec2<i32>(texel), 0).r != NOTHING {
            photon.end = END_BLOCKED;
        }
        return traced(photon);
    }
    let hit = seen.hit;
    if !hit.crosses || (params.range > 0.0 && hit.distance > params.range) {
        return traced(photon);
    }

    photon.end = END_LANDED;
    var way: Way;
    if params.path == PATH_REFLECTED {
        way = reflected(photon, view, light_ray, seen, band);
    } else {
        way = refracted(photon, view, light_ray, seen, band);
    }
    photon = way.photon;
    if photon.end != END_LANDED {
        return traced(photon);
    }

    let landing = find_landing(way.ray);
    photon.end = landing.end;
    if landing.end != END_LANDED && !landing.beside {
        return traced(photon);
    }
    let at = on_map(landing.at, params.landing_view, params.map_view, way.ray.origin + landing.distance * way.ray.direction);
    if !at.found {
        photon.end = END_OUTSIDE_MAP;
        return traced(photon);
    }
    photon.astray = landing.astray;
    photon.beside = landing.beside;
    photon = absorb(photon, exp(-way.absorption * landing.distance));
    let lit = triangles[landing.visible - 1u].material;
    let weight = bands[(params.first_band + band) * params.materials + lit].weight;
    let deposit = vec3<u32>(
        flux_part(photon.flux, weight.x),
        flux_part(photon.flux, weight.y),
        flux_part(photon.flux, weight.z),
    );
    return Traced(photon, true, at, deposit);
}

const TILE: u32 = 8u;     // photons along each side of a workgroup
const PHOTONS: u32 = 64u; // per workgroup

// Two landings farther apart than this, texels, do not belong to one beam.
const FARTHEST_NEIGHBOUR: f32 = 16.0;

// Standard deviations that a splat reaches at least, but for this part of a texel.
const REACH_SIGMAS: f32 = 2.5;
const REACH_ROUNDING: f32 = 0.25;

var<workgroup> ends: array<u32, PHOTONS>;              // END_*, LEDGER_ROWS beside the grid
var<workgroup> fluxes: array<vec4<u32>, PHOTONS>;      // aimed, reflected, kept inside, absorbed
var<workgroup> remaining: array<vec3<u32>, PHOTONS>;   // left at the end, astray, beside
var<workgroup> places: array<vec3<f32>, PHOTONS>;      // texel of the map; its face, below 0 where nothing was left

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
    let finer = views[params.landing_view + face].texel_slope / views[params.map_view + face].texel_slope;
    let spacing = params.splat_spacing * finer;
    let a = step_to_neighbour(own, place % TILE, place, 1u, vec2<f32>(spacing.x, 0.0));
    let b = step_to_neighbour(own, place / TILE, place, TILE, vec2<f32>(0.0, spacing.y));
    let most = (f32(params.splat_taps) + REACH_ROUNDING) / REACH_SIGMAS;
    return clamp(params.splat_share * sqrt(a * a + b * b), vec2<f32>(params.splat_sigma), vec2<f32>(most));
}

fn entry_of_row(row: u32, i: u32) -> vec2<u32> { // flux, photons
    let end = ends[i];
    if end == LEDGER_ROWS {
        return vec2<u32>(0u);
    }
    switch row {
        case LEDGER_AIMED: {
            return vec2<u32>(fluxes[i].x, 1u);
        }
        case LEDGER_EMITTED: {
            let emitted = end != END_MISSED && end != END_BLOCKED;
            return select(vec2<u32>(0u), vec2<u32>(fluxes[i].x, 1u), emitted);
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

// Which texel of each square of `sample_stride` texels along each side is traced: another one at each wavelength.
fn sampled_texel(band: u32) -> vec2<u32> {
    let stride = params.sample_stride;
    let place = (7u * band + 10u) % (stride * stride);
    return vec2<u32>(place % stride, place / stride);
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

@compute @workgroup_size(8, 8, 1)
fn photon_trace(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) in_tile: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    ends[local] = LEDGER_ROWS;
    places[local] = vec3<f32>(0.0, 0.0, -1.0);
    var left = traced(Photon(END_MISSED, 0u, 0u, 0u, 0u, 0u, false, false));
    var tile = group.xy;
    var exists = true;
    if params.emission == EMISSION_QUEUE {
        let i = queue_row(group, params.max_groups);
        exists = i < queue[QUEUE_COUNT];
        if exists {
            tile = queue_cell(queue[QUEUE_HEAD + i]);
        }
    }
    var texel = TILE * tile + in_tile.xy;
    if params.emission == EMISSION_SAMPLE {
        texel = params.sample_stride * texel + sampled_texel(group.z);
    }
    if exists && all(texel < views[params.emission_view].size) {
        left = trace(texel, group.z);
        let photon = left.photon;
        ends[local] = photon.end;
        fluxes[local] = vec4<u32>(photon.aimed, photon.reflected, photon.kept_inside, photon.absorbed);
        remaining[local] = vec3<u32>(photon.flux, u32(photon.astray), u32(photon.beside));
        if left.deposits {
            places[local] = vec3<f32>(left.at.texel, f32(left.at.face));
        }
    }
    if params.emission == EMISSION_SAMPLE {
        if left.deposits {
            landing_bounds_add(left.at);
        }
        return;
    }
    workgroupBarrier();
    if left.deposits {
        var sigma = vec2<f32>(params.splat_sigma);
        var reach = vec2<u32>(params.splat_taps);
        if params.splat_share != 0.0 {
            sigma = splat_sigma(local);
            reach = vec2<u32>(ceil(REACH_SIGMAS * sigma - REACH_ROUNDING));
        }
        splat(left.at, left.deposit, reach, sigma);
    }
    if local >= LEDGER_ROWS {
        return;
    }
    var low = 0u;
    var high = 0u;
    var photons = 0u;
    for (var i = 0u; i < PHOTONS; i++) {
        let entry = entry_of_row(local, i);
        low += entry.x;
        if low < entry.x {
            high += 1u;
        }
        photons += entry.y;
    }
    let index = LEDGER_WORDS * (LEDGER_ROWS * (params.first_ledger + group.z) + local);
    let before = atomicAdd(&ledger[index], low);
    if before + low < low {
        high += 1u;
    }
    if high != 0u {
        atomicAdd(&ledger[index + 1u], high);
    }
    if photons != 0u {
        atomicAdd(&ledger[index + 2u], photons);
    }
}
