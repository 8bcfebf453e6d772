// Whether the surface may shade itself: its highest sample and its steepest slope. Host side: `passes/pond_relief.rs`.

struct PondRelief {
    grid: PondGrid,
}

@group(0) @binding(0) var<uniform> params: PondRelief;
@group(0) @binding(1) var<storage, read> heights: array<f32>;
@group(0) @binding(2) var<storage, read_write> relief: array<atomic<u32>>; // highest, as `pond_ordered`; steepest, its bits

// A number that is larger where `x` is.
fn pond_ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, bits >= 0x80000000u);
}

var<workgroup> highest: atomic<u32>;
var<workgroup> steepest: atomic<u32>;

@compute @workgroup_size(8, 8, 1)
fn pond_relief(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    if pond_contains(params.grid, id.xy) {
        let next = (id.xy + 1u) % params.grid.size;
        let here = heights[pond_index(params.grid, id.xy)];
        let east = heights[pond_index(params.grid, vec2<u32>(next.x, id.y))] - here;
        let north = heights[pond_index(params.grid, vec2<u32>(id.x, next.y))] - here;
        let slopes = abs(vec2<f32>(east, north) / params.grid.pitch_m);
        atomicMax(&highest, pond_ordered(here));
        atomicMax(&steepest, bitcast<u32>(max(slopes.x, slopes.y)));
    }
    workgroupBarrier();
    if local == 0u {
        atomicMax(&relief[0], atomicLoad(&highest));
        atomicMax(&relief[1], atomicLoad(&steepest));
    }
}
