// Caustics mapping (Shah et al.), one photon per texel of the light's emission view and wavelength, in tiles of 8 x 8: refract
// at the entry, find and refract at the exit, or reflect at the first surface; find the landing, add the flux to the map. Host side: `passes/photon_trace.rs`.
//
// path      what photons do where the light meets glass or a mirror first: go in, or go back
// entry     where the light meets glass first
// exit      where it leaves the same glass again
// landing   where it meets an opaque surface

struct PhotonTrace {
    photons: Photons,
    interfaces: u32,          // 1: only the entry refracts (Shah); 2: the exit too
    exit_iterations: u32,
    exit_reach: f32,          // no way through glass is longer
    reserved0: u32,
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

fn face_at(texel: vec2<i32>) -> u32 {
    if params.photons.path == PATH_REFLECTED {
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

// A photon behind all surfaces that it meets, END_LANDED if it goes on.
struct Way {
    photon: Photon,
    ray: Ray,
    absorption: f32, // on the way to the landing, per working unit
}

fn medium_of(front: Triangle, band: u32) -> Optics {
    return optics[(params.photons.first_band + band) * params.photons.materials + front.material];
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
    let first = cross_surface(light_ray.direction, lit_normal(front, hit), front, eta, params.photons.rule);
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
    let second = cross_surface(ray.direction, -interpolated_normal(back, exit.hit), back, 1.0 / medium.index, params.photons.rule);
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
        share = interface_reflectance(light_ray.direction, normal, eta, params.photons.rule);
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

fn trace(texel: vec2<u32>, band: u32) -> Traced {
    let view = views[params.photons.emission_view];
    let light_ray = view_ray(view, vec2<f32>(texel) + 0.5);
    var photon = emitted(view, texel, light_ray);

    let seen = entry_at(view, vec2<i32>(texel), light_ray);
    if seen.visible == NOTHING {
        return leaves_nothing(photon);
    }
    let front = triangles[seen.visible - 1u];
    if (front.flags & params.photons.casters) == 0u {
        if (front.flags & TRIANGLE_REFRACTS) == 0u && textureLoad(exit_visibility, vec2<i32>(texel), 0).r != NOTHING {
            photon.end = END_BLOCKED;
        }
        return leaves_nothing(photon);
    }
    let hit = seen.hit;
    if !hit.crosses || (params.photons.range > 0.0 && hit.distance > params.photons.range) {
        return leaves_nothing(photon);
    }

    photon.end = END_LANDED;
    var way: Way;
    if params.photons.path == PATH_REFLECTED {
        way = reflected(photon, view, light_ray, seen, band);
    } else {
        way = refracted(photon, view, light_ray, seen, band);
    }
    photon = way.photon;
    if photon.end != END_LANDED {
        return leaves_nothing(photon);
    }

    let landing = find_landing(way.ray);
    photon.end = landing.end;
    if landing.end != END_LANDED && !landing.beside {
        return leaves_nothing(photon);
    }
    photon.astray = landing.astray;
    photon.beside = landing.beside;
    photon = absorb(photon, exp(-way.absorption * landing.distance));
    return put_down(photon, landing.at, way.ray.origin + landing.distance * way.ray.direction, landing.visible, band);
}

@compute @workgroup_size(8, 8, 1)
fn photon_trace(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) in_tile: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let start = photon_start(group, in_tile.xy);
    var left = leaves_nothing(Photon(END_MISSED, 0u, 0u, 0u, 0u, 0u, false, false));
    if start.exists {
        left = trace(start.texel, group.z);
    }
    if params.photons.emission == EMISSION_SAMPLE {
        if left.deposits {
            landing_bounds_add(left.at);
        }
        return;
    }
    show(local, start.exists, left);
    workgroupBarrier();
    lay_down(local, left);
    if local < LEDGER_ROWS {
        book_row(local, group.z, count_row(local, true, RowSum(0u, 0u, 0u)));
    }
}
