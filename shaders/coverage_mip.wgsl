// How many texels of the emission view matter under each cell of a mip level: those that show glass or a mirror, or glass
// behind what stands before it. Host side: `passes/coverage_mip.rs`.

struct CoverageMip {
    level: u32,      // 0 counts texels of tiles, a workgroup each; others add up cells of the level below
    casters: u32,    // TRIANGLE_* of what photons are for
    size: vec2<u32>, // cells of this level
}

@group(0) @binding(0) var<uniform> params: CoverageMip;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var source: texture_2d<u32>;          // what the emission view sees first, or the level below
@group(0) @binding(3) var exit_visibility: texture_2d<u32>; // back faces of glass in the emission view
@group(0) @binding(4) var coverage: texture_storage_2d<r32uint, write>;

// Photons from elsewhere are counted as missed, without any other trace of them.
fn covered(texel: vec2<i32>) -> bool {
    if any(vec2<u32>(texel) >= textureDimensions(source)) {
        return false;
    }
    let visible = textureLoad(source, texel, 0).r;
    if visible == NOTHING {
        return false;
    }
    return (triangles[visible - 1u].flags & params.casters) != 0u
        || textureLoad(exit_visibility, texel, 0).r != NOTHING;
}

var<workgroup> texels: atomic<u32>;

@compute @workgroup_size(8, 8, 1)
fn coverage_mip(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if params.level == 0u {
        if covered(vec2<i32>(id.xy)) {
            atomicAdd(&texels, 1u);
        }
        workgroupBarrier();
        if local == 0u {
            textureStore(coverage, vec2<i32>(tile.xy), vec4<u32>(atomicLoad(&texels), 0u, 0u, 0u));
        }
        return;
    }
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let cell = vec2<i32>(id.xy);
    var sum = 0u;
    for (var i = 0; i < 4; i++) {
        sum += textureLoad(source, 2 * cell + vec2<i32>(i & 1, i >> 1u), 0).r;
    }
    textureStore(coverage, cell, vec4<u32>(sum, 0u, 0u, 0u));
}
