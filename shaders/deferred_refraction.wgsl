// Glass as a camera sees it (Wyman & Nichols 2009, Blanchette & Agu 2013): each wavelength is refracted where it enters and
// leaves, follows total reflection inside, and fetches the background where it leads. Mirrors throw it on, and an eye in a
// medium sees through what that lets pass. Host side: `passes/deferred_refraction.rs`.
//
// background   what the camera sees without glass, XYZ per sample; mirrors have none
// sample       texel of the camera's view; pixels are means over a grid of them

struct DeferredRefraction {
    size: vec2<u32>,          // pixels
    samples: u32,             // per pixel and axis
    camera_view: u32,
    wavelengths: u32,
    materials: u32,           // row length of `optics`
    exit_iterations: u32,     // guesses at each way through glass
    background_iterations: u32,
    exit_reach: f32,          // no way through glass is longer
    bounces: u32,             // total reflections that are followed, and reflections at mirrors
    rule: u32,                // RULE_*
    mirrors: u32,             // 1 where there are any
    mirror_reach: f32,        // the first guess at what a mirror shows
    eye_object: u32,          // index of the refractor that the eye is in + 1, or 0 in free space
    eye_material: u32,        // its material
    reserved0: u32,
}

// A wavelength's K_n in XYZ: what it adds to XYZ is this times the XYZ that it fetched. All of them sum to the identity.
struct ViewBand {
    from_x: vec3<f32>,
    reserved0: u32,
    from_y: vec3<f32>,
    reserved1: u32,
    from_z: vec3<f32>,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: DeferredRefraction;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> bands: array<ViewBand>;
@group(0) @binding(4) var<storage, read> optics: array<Optics>; // wavelength * materials + material
@group(0) @binding(5) var<storage, read> background: array<vec4<f32>>;
@group(0) @binding(6) var camera_visibility: texture_2d<u32>; // opaque surfaces
@group(0) @binding(7) var glass_visibility: texture_2d<u32>;  // refractors
@group(0) @binding(8) var back_visibility: texture_2d<u32>;   // back faces of refractors
@group(0) @binding(9) var<storage, read_write> picture: array<vec4<f32>>;
@group(0) @binding(10) var<storage, read_write> counts: array<atomic<u32>>;

// How a wavelength's way ends.
const SEEN: u32 = 0u;           // at a background that the picture shows
const SEEN_HIDDEN: u32 = 1u;    // at a surface that something hides in the picture: what hides it is fetched
const SEEN_OUTSIDE: u32 = 2u;   // at a surface that goes on beside the picture: the picture's edge is fetched
const SEEN_NOTHING: u32 = 3u;   // past every surface that the picture shows: dark
const SEEN_TOTAL: u32 = 4u;     // reflected more often than is followed: dark
const SEEN_NO_EXIT: u32 = 5u;   // no way out in the picture, or off the wrong side of a facet: dark
const SEEN_ROWS: u32 = 6u;

fn glass_at(layer: u32, texel: vec2<i32>) -> u32 {
    if layer == 0u {
        return textureLoad(back_visibility, texel, 0).r;
    }
    return textureLoad(glass_visibility, texel, 0).r;
}

// Where a ray inside `object` leaves by faces that a layer shows.
fn exit_in_layer(view: View, ray: Ray, object: u32, layer: u32) -> ExitSearch {
    var search = exit_search(params.exit_reach, EXIT_OF_BODY);
    for (var i = 0u; i < params.exit_iterations && !search.done; i++) {
        let texel = view_texel(view, ray.origin + search.distance * ray.direction);
        search = exit_search_step(search, glass_at(layer, texel), ray, object);
    }
    if exit_search_is_close(search) {
        let texel = view_texel(view, ray.origin + search.hit.distance * ray.direction);
        for (var i = 0; i < 8; i++) {
            search = exit_search_beside(search, glass_at(layer, texel_beside(view, texel, i)), ray, object);
        }
    }
    return search;
}

// The back faces that the camera sees, and after a reflection the front faces too.
fn find_exit(view: View, ray: Ray, object: u32, reflected: bool) -> ExitSearch {
    let back = exit_in_layer(view, ray, object, 0u);
    if !reflected || back.contained {
        return back;
    }
    let front = exit_in_layer(view, ray, object, 1u);
    let nearer = front.found && (!back.found || front.hit.distance < back.hit.distance);
    if front.contained || nearer {
        return front;
    }
    return back;
}

struct Seen {
    end: u32, // SEEN_*
    xyz: vec3<f32>,
}

fn unseen(end: u32) -> Seen {
    return Seen(select(SEEN_NO_EXIT, SEEN_TOTAL, end == END_TOTAL), vec3<f32>(0.0));
}

fn is_mirror(visible: u32) -> bool {
    return params.mirrors == 1u && visible != NOTHING && (triangles[visible - 1u].flags & TRIANGLE_MIRROR) != 0u;
}

// What is matt there, between texels.
fn background_at(view: View, texel: vec2<f32>) -> vec3<f32> {
    let at = clamp(texel, vec2<f32>(0.5), vec2<f32>(view.size) - 0.5);
    let corner = floor(at - 0.5);
    let share = (at - 0.5) - corner;
    var sum = vec3<f32>(0.0);
    var mirrors = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let side = vec2<u32>(i & 1u, i >> 1u);
        let place = vec2<u32>(clamp(corner + vec2<f32>(side), vec2<f32>(0.0), vec2<f32>(view.size) - 1.0));
        let weight = select(1.0 - share.x, share.x, side.x == 1u) * select(1.0 - share.y, share.y, side.y == 1u);
        if weight > 0.0 {
            sum += weight * background[place.y * view.size.x + place.x].xyz;
            if is_mirror(textureLoad(camera_visibility, vec2<i32>(place), 0).r) {
                mirrors += weight;
            }
        }
    }
    if mirrors > 0.0 && mirrors < 0.999 {
        sum /= 1.0 - mirrors;
    }
    return sum;
}

// Where a ray meets what the camera sees.
struct Background {
    end: u32,         // SEEN_*
    distance: f32,
    texel: vec2<f32>,
    mirror: u32,      // as in visibility buffers, where a mirror is met
}

// The plane of the surface under a guess is the next guess. `visible` is under the first one, at `reach`. Of mirrors only what
// is on the surface itself counts, since curved ones lie before many of their own planes.
fn find_background(view: View, reach: f32, first_visible: u32, ray: Ray) -> Background {
    // What GLSL's refract() makes of total reflection goes nowhere.
    if all(ray.direction == vec3<f32>(0.0)) {
        return Background(SEEN_TOTAL, 0.0, view_project(view, ray.origin).texel, NOTHING);
    }
    let nothing = Background(SEEN_NOTHING, 0.0, vec2<f32>(0.0), NOTHING);
    var distance = reach;
    var visible = first_visible;
    var last = NOTHING;
    var found = false;
    var contained = false; // the guess is on the surface itself, not only in its plane
    for (var i = 0u; i < params.background_iterations; i++) {
        var ahead = -1.0;
        var in_triangle = false;
        if visible != NOTHING {
            let hit = plane_hit(triangles[visible - 1u], ray);
            in_triangle = inside(hit);
            if hit.crosses && (!is_mirror(visible) || (in_triangle && hit.distance > SAME_SURFACE)) {
                ahead = hit.distance;
            }
        }
        if ahead > -SAME_SURFACE {
            found = true;
            contained = in_triangle;
            distance = max(ahead, 0.0);
            if visible == last {
                break;
            }
            last = visible;
        } else {
            distance *= 0.5;
        }
        visible = textureLoad(camera_visibility, view_texel(view, ray.origin + distance * ray.direction), 0).r;
    }
    if !found {
        return nothing;
    }
    let at = view_project(view, ray.origin + distance * ray.direction);
    if at.z <= 0.0 || (!contained && !view_holds(view, at)) {
        return nothing;
    }
    var result = Background(SEEN, distance, at.texel, NOTHING);
    if !view_holds(view, at) {
        result.end = SEEN_OUTSIDE;
        return result;
    }
    let there = textureLoad(camera_visibility, vec2<i32>(at.texel), 0).r;
    if there == NOTHING {
        result.end = SEEN_NOTHING;
        return result;
    }
    let hit = plane_hit(triangles[there - 1u], ray);
    if !hit.crosses || abs(hit.distance - distance) > 0.01 * distance + SAME_SURFACE {
        result.end = SEEN_HIDDEN;
    } else if is_mirror(there) {
        result.mirror = there;
    }
    return result;
}

// What one wavelength shows of `found` on `start`'s way, where `absorption` is that of what it travels in: mirrors throw it on.
fn see_background(view: View, start: Ray, first: Background, absorption: f32, wavelength: u32) -> Seen {
    var ray = start;
    var found = first;
    var passes = exp(-absorption * found.distance);
    for (var bounce = 0u; found.mirror != NOTHING; bounce++) {
        if bounce > params.bounces {
            return unseen(END_TOTAL);
        }
        let mirror = triangles[found.mirror - 1u];
        let hit = plane_hit(mirror, ray);
        let normal = -sign(hit.facing) * interpolated_normal(mirror, hit);
        let at_normal = optics[wavelength * params.materials + mirror.material].surface;
        let back = reflect_at(ray.direction, normal, mirror, mirror_reflectance(ray.direction, normal, at_normal));
        if back.end != END_LANDED {
            return unseen(back.end);
        }
        ray = Ray(ray.origin + hit.distance * ray.direction, back.direction);
        let guess = view_texel(view, ray.origin + params.mirror_reach * ray.direction);
        found = find_background(view, params.mirror_reach, textureLoad(camera_visibility, guess, 0).r, ray);
        passes *= back.reflectance * exp(-absorption * found.distance);
    }
    if found.end == SEEN_NOTHING {
        return Seen(SEEN_NOTHING, vec3<f32>(0.0));
    }
    return Seen(found.end, passes * background_at(view, found.texel));
}

// What one wavelength sees through glass that the camera's ray meets at `hit`, before or behind which `opaque` is seen.
fn see_through(view: View, opaque: u32, camera_ray: Ray, front: Triangle, hit: PlaneHit, wavelength: u32) -> Seen {
    let medium = optics[wavelength * params.materials + front.material];
    let open = (front.flags & TRIANGLE_OPEN) != 0u;
    var ray = camera_ray;
    var passes = 1.0;
    var in_glass = true;
    if hit.facing < 0.0 {
        let first = cross_surface(ray.direction, interpolated_normal(front, hit), front, medium.index, params.rule);
        if first.end != END_LANDED {
            return unseen(first.end);
        }
        passes *= (1.0 - first.reflectance) * medium.surface;
        ray = Ray(ray.origin + hit.distance * ray.direction, first.direction);
    } else {
        // What is kept along a ray is radiance over the square of the index.
        passes *= medium.index * medium.index;
    }
    for (var bounce = 0u; in_glass; bounce++) {
        var exit = ExitSearch(true, true, true, 0u, hit, hit.distance, 0.0, 0.0, EXIT_OF_BODY);
        var back = front;
        if bounce > 0u || hit.facing < 0.0 {
            exit = find_exit(view, ray, front.object, bounce > 0u);
            // Behind an open surface a plane that is crossed beside its triangle says nothing.
            if !exit.found || (open && !exit.contained) {
                if open {
                    break; // the background is inside
                }
                return unseen(END_NO_EXIT);
            }
            back = triangles[exit.triangle];
        }
        passes *= exp(-medium.absorption * exit.hit.distance);
        let point = ray.origin + exit.hit.distance * ray.direction;
        let inwards = -interpolated_normal(back, exit.hit);
        let out = cross_surface(ray.direction, inwards, back, 1.0 / medium.index, params.rule);
        if out.end == END_LANDED {
            passes *= (1.0 - out.reflectance) * medium.surface;
            ray = Ray(point, out.direction);
            in_glass = false;
        } else if out.end == END_TOTAL && bounce < params.bounces {
            ray = Ray(point, normalize(ray.direction - 2.0 * dot(ray.direction, inwards) * inwards));
        } else {
            return unseen(out.end);
        }
    }
    var absorption = 0.0;
    if in_glass {
        absorption = medium.absorption;
        passes /= medium.index * medium.index;
    }
    let found = find_background(view, params.exit_reach, opaque, ray);
    var seen = see_background(view, ray, found, absorption, wavelength);
    seen.xyz *= passes;
    return seen;
}

var<workgroup> ends: array<atomic<u32>, SEEN_ROWS>;

// XYZ of a sample: through the nearest refractor if there is one before what is opaque, by way of mirrors, and through what the
// eye is in.
fn radiance_at(sample: vec2<u32>) -> vec3<f32> {
    let view = views[params.camera_view];
    let texel = vec2<i32>(sample);
    let behind = background[sample.y * view.size.x + sample.x].xyz;
    let opaque = textureLoad(camera_visibility, texel, 0).r;
    let glass = textureLoad(glass_visibility, texel, 0).r;
    let mirror = is_mirror(opaque);
    if glass == NOTHING && !mirror && params.eye_object == 0u {
        return behind;
    }
    let ray = view_ray(view, vec2<f32>(sample) + 0.5);
    var direct = Background(SEEN_NOTHING, 0.0, vec2<f32>(sample) + 0.5, NOTHING);
    if opaque != NOTHING {
        let hit = plane_hit(triangles[opaque - 1u], ray);
        if hit.crosses {
            direct = Background(SEEN, hit.distance, direct.texel, select(NOTHING, opaque, mirror));
        }
    }
    var through = false;
    var front: Triangle;
    var hit: PlaneHit;
    if glass != NOTHING {
        front = triangles[glass - 1u];
        hit = plane_hit(front, ray);
        through = hit.crosses && (direct.end == SEEN_NOTHING || hit.distance < direct.distance);
    }
    if !through && !mirror && params.eye_object == 0u {
        return behind;
    }
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < params.wavelengths; i++) {
        var seen: Seen;
        if through {
            seen = see_through(view, opaque, ray, front, hit, i);
        } else {
            var absorption = 0.0;
            if params.eye_object != 0u {
                absorption = optics[i * params.materials + params.eye_material].absorption;
            }
            seen = see_background(view, ray, direct, absorption, i);
        }
        atomicAdd(&ends[seen.end], 1u);
        let band = bands[i];
        sum += mat3x3<f32>(band.from_x, band.from_y, band.from_z) * seen.xyz;
    }
    // Only now: bands one by one may be negative where their weights are of RGB.
    return max(sum, vec3<f32>(0.0));
}

@compute @workgroup_size(8, 8, 1)
fn deferred_refraction(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if id.x < params.size.x && id.y < params.size.y {
        var sum = vec3<f32>(0.0);
        for (var j = 0u; j < params.samples; j++) {
            for (var i = 0u; i < params.samples; i++) {
                sum += radiance_at(id.xy * params.samples + vec2<u32>(i, j));
            }
        }
        let samples = f32(params.samples * params.samples);
        picture[id.y * params.size.x + id.x] = vec4<f32>(sum / samples, 0.0);
    }
    workgroupBarrier();
    if local < SEEN_ROWS {
        let count = atomicLoad(&ends[local]);
        let before = atomicAdd(&counts[2u * local], count);
        if before + count < count {
            atomicAdd(&counts[2u * local + 1u], 1u);
        }
    }
}
