// Light of one light at a point of an opaque surface. Host side: asm-core's `shared/irradiance.rs`.
//
// Expects the globals `params.light`, `triangles`, `views`, `direct_visibility` (opaque surfaces), `landing_visibility` (matt
// surfaces behind the front of the glass, where refracted light lands), `reflected_visibility` (matt surfaces, where reflected
// light lands), `entry_visibility` (everything, in the emission view) and `caustic`.

struct Light {
    xyz: vec3<f32>,         // as it arrives: lux for parallel rays, candela for rays from an eye
    metres_per_unit: f32,
    spot_axis: vec3<f32>,
    spot_scale: f32,        // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_offset: f32,
    range: f32,             // dark beyond; 0 has no end
    landing_from: f32,      // distance of the front of the glass: nothing nearer is in the map
    direct_view: u32,
    direct_faces: u32,
    landing_view: u32,
    landing_faces: u32,     // 0 where no refracted light is mapped
    emission_view: u32,
    emits: u32,             // 1 where there is an emission view
    reflected_faces: u32,   // as many as `landing_faces`, or 0 where no reflected light is mapped
    first_reflected: u32,   // first texel of the map of reflected light, in `caustic`
    map_view: u32,          // first of the map of refracted light, one per view of where light may land
    receiver_map: u32,      // 1: the maps hold a receiver's texels and what arrives there, lux; 0: they are seen from the light
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

struct Irradiance {
    direct: f32,          // lux per lux or candela of the light
    refracted: vec3<f32>, // XYZ of the map
    reflected: vec3<f32>, // light that a mirror or the outside of glass threw back, as `refracted`
}

// Share of the way to the middle of its triangle from where a point looks for what blocks its light.
const FARTHER_IN: f32 = 1e-4;

// A point as a light sees it.
struct Lit {
    position: vec3<f32>,
    own: u32,          // its triangle, as visibility buffers count
    to_light: Ray,     // from about the position
    distance: f32,     // along the light's ray
    clear: f32,        // how far towards the light anything could stand
}

fn blocks(visible: u32, lit: Lit) -> bool {
    if visible == NOTHING || visible == lit.own {
        return false;
    }
    let hit = plane_hit(triangles[visible - 1u], lit.to_light);
    return inside(hit) && hit.distance > SAME_SURFACE && hit.distance < lit.clear;
}

// One of the four texels whose centres surround a point.
fn surrounding_texel(texel: vec2<f32>, size: vec2<u32>, i: u32) -> vec2<i32> {
    let corner = vec2<i32>(floor(texel - 0.5)) + vec2<i32>(i32(i & 1u), i32(i >> 1u));
    return clamp(corner, vec2<i32>(0), vec2<i32>(size) - 1);
}

// What the texel shows is nearer to the light than the point, by more than two texels are wide. Triangles smaller than
// texels slip through `blocks`; where all surrounding texels show something nearer, it is taken to be in the way.
fn shows_nearer(visible: u32, lit: Lit, view: View, texel: vec2<i32>) -> bool {
    if visible == NOTHING || visible == lit.own {
        return false;
    }
    let hit = plane_hit(triangles[visible - 1u], view_ray(view, vec2<f32>(texel) + 0.5));
    let width = max(view.texel_slope.x, view.texel_slope.y) * select(1.0, lit.distance, view.perspective == 1u);
    return hit.crosses && hit.distance < lit.distance - 2.0 * width;
}

fn blocked_by_opaque(lit: Lit) -> bool {
    let at = locate(params.light.direct_view, params.light.direct_faces, lit.position);
    if !at.found {
        return false;
    }
    let view = views[at.view];
    var surrounded = true;
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, view.size, i);
        let visible = textureLoad(direct_visibility, texel, i32(at.face), 0).r;
        if blocks(visible, lit) {
            return true;
        }
        surrounded = surrounded && shows_nearer(visible, lit, view, texel);
    }
    return surrounded;
}

fn blocked_by_glass(lit: Lit) -> bool {
    if params.light.emits == 0u {
        return false;
    }
    let view = views[params.light.emission_view];
    let at = view_project(view, lit.position);
    if !view_holds(view, at) {
        return false;
    }
    var surrounded = true;
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, view.size, i);
        let visible = textureLoad(entry_visibility, texel, 0).r;
        if blocks(visible, lit) {
            return true;
        }
        surrounded = surrounded && shows_nearer(visible, lit, view, texel);
    }
    return surrounded;
}

fn landing_shown(texel: vec2<i32>, face: i32, reflected: bool) -> u32 {
    if reflected {
        return textureLoad(reflected_visibility, texel, face, 0).r;
    }
    return textureLoad(landing_visibility, texel, face, 0).r;
}

// The texel of a receiver's own map that holds a point.
fn received_at(p: vec3<f32>, reflected: bool) -> vec3<f32> {
    let faces = select(params.light.landing_faces, params.light.reflected_faces, reflected);
    let at = locate(params.light.landing_view, faces, p);
    if !at.found {
        return vec3<f32>(0.0);
    }
    let size = views[at.view].size;
    let texel = min(vec2<u32>(at.texel), size - 1u);
    return caustic[select(0u, params.light.first_reflected, reflected) + texel.y * size.x + texel.x].xyz;
}

// The map at a point: bilinear, and only where the point is on the surface that the landing view sees.
fn caustic_at(lit: Lit, reflected: bool) -> vec3<f32> {
    let faces = select(params.light.landing_faces, params.light.reflected_faces, reflected);
    if faces == 0u || lit.clear < -SAME_SURFACE {
        return vec3<f32>(0.0);
    }
    let at = locate(params.light.landing_view, faces, lit.position);
    if !at.found {
        return vec3<f32>(0.0);
    }
    let view = views[at.view];
    let first = select(0u, params.light.first_reflected, reflected);
    var surrounded = true;
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, view.size, i);
        let visible = landing_shown(texel, i32(at.face), reflected);
        if blocks(visible, lit) {
            return vec3<f32>(0.0);
        }
        surrounded = surrounded && shows_nearer(visible, lit, view, texel);
    }
    let map_view = select(params.light.map_view, params.light.landing_view, reflected);
    let place = on_map(at, params.light.landing_view, map_view, lit.position);
    if surrounded || !place.found {
        return vec3<f32>(0.0);
    }
    let share = fract(place.texel - 0.5);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(place.texel, view.size, i);
        let weight = select(1.0 - share.x, share.x, (i & 1u) == 1u) * select(1.0 - share.y, share.y, (i & 2u) == 2u);
        sum += weight * caustic[first + (at.face * view.size.y + u32(texel.y)) * view.size.x + u32(texel.x)].xyz;
    }
    return sum;
}

// Light on a surface at `p` with the unit normal `normal`, part of triangle `own` (as visibility buffers count);
// light from behind does not count.
fn irradiance_at(p: vec3<f32>, normal: vec3<f32>, own: u32) -> Irradiance {
    let view = views[params.light.direct_view];
    let light_ray = view_ray_through(view, p);
    let cosine = -dot(light_ray.direction, normal);
    var received = Irradiance(0.0, vec3<f32>(0.0), vec3<f32>(0.0));
    if params.light.receiver_map == 1u {
        received.refracted = received_at(p, false);
        received.reflected = received_at(p, true);
    }
    if cosine <= 0.0 {
        return received;
    }
    let distance = dot(p - light_ray.origin, light_ray.direction);
    var spread = cosine;
    var clear = 1e30;
    if view.perspective == 1u {
        let metres = distance * params.light.metres_per_unit;
        spread = cosine / (metres * metres);
        clear = distance;
    }
    // In a crease rounding could put the point on the wrong side of the other surface: look from a little farther in.
    let t = triangles[own - 1u];
    let inner = p + FARTHER_IN * ((t.p0 + t.p1 + t.p2) / 3.0 - p);
    var lit = Lit(p, own, Ray(inner, -light_ray.direction), distance, clear);
    let in_range = params.light.range == 0.0 || distance <= params.light.range;
    if in_range && !blocked_by_opaque(lit) && !blocked_by_glass(lit) {
        let light = params.light;
        let falloff = spot_falloff(light_ray.direction, light.spot_axis, light.spot_scale, light.spot_offset);
        received.direct = spread * falloff;
    }
    if params.light.receiver_map == 0u {
        received.reflected = spread * caustic_at(lit, true);
        lit.clear = distance - params.light.landing_from;
        received.refracted = spread * caustic_at(lit, false);
    }
    return received;
}
