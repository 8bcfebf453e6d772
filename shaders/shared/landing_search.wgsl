// Where a ray lands, from what views show. Host side: asm-core's `shared/landing_search.rs`.
//
// Expects the globals `params.photons`, `triangles`, `views` and `landing_visibility`.

const LANDING_DISTANCE: u32 = 0u; // Shah's update: the distance of the surface point below the last guess
const LANDING_PLANE: u32 = 1u;    // the ray against the plane of the triangle below the last guess

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
    let middle = locate_clamped(params.photons.landing_view, params.photons.landing_faces, params.photons.landing_center);
    return textureLoad(landing_visibility, vec2<i32>(middle.texel), i32(middle.face), 0).r;
}

// A place that no surface covers in the view lies where a surface nearby would go on: what arrives there blurs into the
// surface as much as what arrives on it blurs out.
fn beside_surface(at: Located, ray: Ray, distance: f32) -> u32 {
    let size = vec2<f32>(views[at.view].size);
    for (var i = 0u; i < 8u; i++) {
        let side = i + i / 4u; // the eight places round the middle of 3 x 3
        let offset = params.photons.guard_texels * vec2<f32>(f32(side % 3u) - 1.0, f32(side / 3u) - 1.0);
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
    var distance = max(dot(params.photons.landing_center - ray.origin, ray.direction), 0.0);
    var last = NOTHING;
    for (var i = 0u; i < params.photons.landing_iterations; i++) {
        let guess = ray.origin + distance * ray.direction;
        let at = locate_clamped(params.photons.landing_view, params.photons.landing_faces, guess);
        var visible = NOTHING;
        if at.found {
            visible = landing_triangle(at);
        }
        if visible == NOTHING {
            distance *= 0.5;
            continue;
        }
        let ahead = plane_hit(triangles[visible - 1u], ray);
        if params.photons.landing_update == LANDING_PLANE && ahead.crosses && ahead.distance >= 0.0 {
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
    let at = locate(params.photons.landing_view, params.photons.landing_faces, point);
    if !at.found {
        return Landing(END_OUTSIDE_MAP, at, NOTHING, distance, false, false);
    }
    let visible = textureLoad(landing_visibility, vec2<i32>(at.texel), i32(at.face), 0).r;
    if visible == NOTHING {
        var near = NOTHING;
        if params.photons.guard_texels > 0.0 {
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
