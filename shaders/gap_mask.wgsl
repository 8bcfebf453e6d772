// Which texels of a map hold light, and which dark ones lie between them. Host side: `passes/gap_mask.rs`.

struct GapMask {
    size: vec2<u32>,  // of one face of the map
    rows: u32,        // of all faces together
    rule: u32,        // GAP_*: only GAP_DISC looks for gaps
    threshold: u32,   // lit texels that face each other across a gap
    offsets: u32,     // number of offsets
    landing_view: u32, // first of the views that show surfaces
    map_view: u32,    // first of the map's
}

@group(0) @binding(0) var<uniform> params: GapMask;
@group(0) @binding(1) var<storage, read> map: array<u32>;
@group(0) @binding(2) var<storage, read> offsets: array<vec2<i32>>;
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(5) var<storage, read_write> mask: array<u32>;

// Y before the others: it is the one that is rarely 0 where there is light.
fn lit(index: u32) -> bool {
    if index == NO_TEXEL {
        return false;
    }
    let word = 6u * index;
    if (map[word + 2u] | map[word + 3u]) != 0u {
        return true;
    }
    return (map[word] | map[word + 1u] | map[word + 4u] | map[word + 5u]) != 0u;
}

// A texel of the map shows a surface.
fn shows_surface(at: vec2<i32>, face: u32) -> bool {
    var seen = at;
    if params.map_view != params.landing_view {
        let landing = views[params.landing_view + face];
        let offset = (view_slope(views[params.map_view + face], vec2<f32>(at) + 0.5) - landing.slope_center) / landing.texel_slope;
        seen = vec2<i32>(floor(0.5 * vec2<f32>(landing.size) + vec2<f32>(offset.x, -offset.y)));
        if any(seen < vec2<i32>(0)) || any(seen >= vec2<i32>(landing.size)) {
            return false;
        }
    }
    return textureLoad(landing_visibility, seen, i32(face), 0).r != NOTHING;
}

fn is_gap(texel: vec2<u32>) -> bool {
    let face = texel.y / params.size.y;
    let at = vec2<i32>(i32(texel.x), i32(texel.y % params.size.y));
    // Light on nothing would be lost.
    if !shows_surface(at, face) {
        return false;
    }
    var facing = 0u;
    for (var i = 0u; i < params.offsets / 2u && facing < params.threshold; i++) {
        let across = params.offsets - 1u - i;
        if lit(texel_at(texel, offsets[i])) && lit(texel_at(texel, offsets[across])) {
            facing += 2u;
        }
    }
    return facing >= params.threshold;
}

@compute @workgroup_size(8, 8, 1)
fn gap_mask(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.size.x || id.y >= params.rows {
        return;
    }
    let index = id.y * params.size.x + id.x;
    var kind = MASK_DARK;
    if lit(index) {
        kind = MASK_LIT;
    } else if params.rule == GAP_DISC && is_gap(id.xy) {
        kind = MASK_GAP;
    }
    mask[index] = kind;
}
