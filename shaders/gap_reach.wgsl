// Which lit texels of a map have a gap within twice the radius: they take part in filling it, so that bands between gaps
// become smooth as a whole; the others stay as sharp as they are. Host side: `passes/gap_reach.rs`.

struct GapReach {
    size: vec2<u32>,  // of one face of the map
    rows: u32,        // of all faces together
    offsets: u32,     // number of offsets
}

@group(0) @binding(0) var<uniform> params: GapReach;
@group(0) @binding(1) var<storage, read> offsets: array<vec2<i32>>;
@group(0) @binding(2) var<storage, read> gaps: array<u32>; // what `gap_mask` made
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;

fn is_gap(texel: vec2<u32>, offset: vec2<i32>) -> bool {
    let at = texel_at(texel, offset);
    return at != NO_TEXEL && gaps[at] == MASK_GAP;
}

@compute @workgroup_size(8, 8, 1)
fn gap_reach(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.size.x || id.y >= params.rows {
        return;
    }
    let index = id.y * params.size.x + id.x;
    var kind = gaps[index];
    if kind == MASK_LIT {
        for (var i = 0u; i < params.offsets; i++) {
            if is_gap(id.xy, offsets[i]) || is_gap(id.xy, 2 * offsets[i]) {
                kind = MASK_BESIDE;
                break;
            }
        }
    }
    mask[index] = kind;
}
