// Light of one light at a point of an opaque surface. Host side: asm-core's `shared/irradiance.rs`.
//
// Expects the globals `params.light`, `triangles`, `views`, `direct_visibility` (opaque surfaces), `landing_visibility`
// (opaque surfaces behind the front of the glass), `entry_visibility` (everything, in the emission view) and `caustic`.

struct Light {
    xyz: vec3<f32>,         // lux for parallel rays, candela for rays from an eye
    metres_per_unit: f32,
    spot_axis: vec3<f32>,
    spot_scale: f32,        // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_offset: f32,
    range: f32,             // dark beyond; 0 has no end
    landing_from: f32,      // distance of the front of the glass: nothing nearer is in the map
    direct_view: u32,
    direct_faces: u32,
    landing_view: u32,
    landing_faces: u32,     // 0 where the light has no map
    emission_view: u32,
}

struct Irradiance {
    direct: vec3<f32>,
    refracted: vec3<f32>,
}

// `to_light` starts at the point in question.
fn blocks(visible: u32, own: u32, to_light: Ray, distance: f32) -> bool {
    if visible == NOTHING || visible == own {
        return false;
    }
    let hit = plane_hit(triangles[visible - 1u], to_light);
    return inside(hit) && hit.distance > SAME_SURFACE && hit.distance < distance;
}

// One of the four texels whose centres surround a point.
fn surrounding_texel(texel: vec2<f32>, size: vec2<u32>, i: u32) -> vec2<i32> {
    let corner = vec2<i32>(floor(texel - 0.5)) + vec2<i32>(i32(i & 1u), i32(i >> 1u));
    return clamp(corner, vec2<i32>(0), vec2<i32>(size) - 1);
}

fn blocked_by_opaque(p: vec3<f32>, own: u32, to_light: Ray, distance: f32) -> bool {
    let at = locate(params.light.direct_view, params.light.direct_faces, p);
    if !at.found {
        return false;
    }
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, views[at.view].size, i);
        if blocks(textureLoad(direct_visibility, texel, i32(at.face), 0).r, own, to_light, distance) {
            return true;
        }
    }
    return false;
}

fn blocked_by_glass(p: vec3<f32>, own: u32, to_light: Ray, distance: f32) -> bool {
    if params.light.landing_faces == 0u {
        return false;
    }
    let view = views[params.light.emission_view];
    let at = view_project(view, p);
    if !view_holds(view, at) {
        return false;
    }
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, view.size, i);
        if blocks(textureLoad(entry_visibility, texel, 0).r, own, to_light, distance) {
            return true;
        }
    }
    return false;
}

// The map at a point: bilinear, and only where the point is on the surface that the map's view sees.
fn caustic_at(p: vec3<f32>, own: u32, to_light: Ray, distance: f32) -> vec3<f32> {
    if params.light.landing_faces == 0u || distance < params.light.landing_from - SAME_SURFACE {
        return vec3<f32>(0.0);
    }
    let at = locate(params.light.landing_view, params.light.landing_faces, p);
    if !at.found {
        return vec3<f32>(0.0);
    }
    let size = views[at.view].size;
    let share = fract(at.texel - 0.5);
    let clear = distance - params.light.landing_from;
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let texel = surrounding_texel(at.texel, size, i);
        if blocks(textureLoad(landing_visibility, texel, i32(at.face), 0).r, own, to_light, clear) {
            return vec3<f32>(0.0);
        }
        let weight = select(1.0 - share.x, share.x, (i & 1u) == 1u) * select(1.0 - share.y, share.y, (i & 2u) == 2u);
        sum += weight * caustic[(at.face * size.y + u32(texel.y)) * size.x + u32(texel.x)].xyz;
    }
    return sum;
}

// XYZ lux on a surface at `p` with the unit normal `normal`, part of triangle `own` (as visibility buffers count); what
// falls on the back counts where the material is double-sided.
fn irradiance_at(p: vec3<f32>, normal: vec3<f32>, own: u32) -> Irradiance {
    let view = views[params.light.direct_view];
    let light_ray = view_ray_through(view, p);
    var cosine = -dot(light_ray.direction, normal);
    if (triangles[own - 1u].flags & TRIANGLE_DOUBLE_SIDED) != 0u {
        cosine = abs(cosine);
    }
    if cosine <= 0.0 {
        return Irradiance(vec3<f32>(0.0), vec3<f32>(0.0));
    }
    let distance = dot(p - light_ray.origin, light_ray.direction);
    let to_light = Ray(p, -light_ray.direction);
    var spread = cosine;
    var end = 1e30;
    if view.perspective == 1u {
        let metres = distance * params.light.metres_per_unit;
        spread = cosine / (metres * metres);
        end = distance;
    }
    var direct = vec3<f32>(0.0);
    let in_range = params.light.range == 0.0 || distance <= params.light.range;
    if in_range && !blocked_by_opaque(p, own, to_light, end) && !blocked_by_glass(p, own, to_light, end) {
        let cone = clamp(dot(light_ray.direction, params.light.spot_axis) * params.light.spot_scale + params.light.spot_offset, 0.0, 1.0);
        direct = spread * cone * cone * params.light.xyz;
    }
    return Irradiance(direct, spread * caustic_at(p, own, to_light, distance));
}
