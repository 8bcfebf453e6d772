// Heights of impulses (section 4.3 of the paper). Host side: `passes/pond_heights.rs`.
//
// h(t, d) = A exp(-beta (f(t) - d)) exp(-alpha t) sin(K d - omega t) behind the wavefront f(t), and 0 ahead of it.

struct PondHeights {
    grid: PondGrid,
    first: u32,          // of `sources`; from 1 on, heights are added to what is there
    count: u32,
    beta_per_m: f32,
    turns_per_m: f32,    // K / (2 pi)
    level_m: f32,        // metres from one level of `distances` to the next
    table: u32,          // 1: distances are those of `distances`, from the nearest sample; 0: they are evaluated
    reserved0: u32,
    reserved1: u32,
}

// An impulse or its image, at one time.
struct RingSource {
    position_m: vec2<f32>,
    sample: vec2<i32>,   // the one it falls on, which may lie outside
    front_m: f32,        // f(t)
    amplitude_m: f32,    // A exp(-alpha t)
    phase_turns: f32,    // omega t / (2 pi), without whole turns
    reserved: f32,
}

@group(0) @binding(0) var<uniform> params: PondHeights;
@group(0) @binding(1) var<storage, read> sources: array<RingSource>;
@group(0) @binding(2) var<storage, read> distances: array<u32>;
@group(0) @binding(3) var<storage, read_write> heights: array<f32>;

const TAU: f32 = 6.283185307179586;

@compute @workgroup_size(8, 8, 1)
fn pond_heights(@builtin(global_invocation_id) id: vec3<u32>) {
    if !pond_contains(params.grid, id.xy) {
        return;
    }
    let index = pond_index(params.grid, id.xy);
    let at_m = (vec2<f32>(id.xy) + 0.5) * params.grid.pitch_m;
    var height = 0.0;
    if params.first > 0u {
        height = heights[index];
    }
    for (var i = params.first; i < params.first + params.count; i++) {
        let source = sources[i];
        var distance_m = length(at_m - source.position_m);
        if params.table == 1u {
            // The table is four ponds wide and high, with the impulse in its middle.
            let table_size = 4u * params.grid.size;
            let entry = vec2<i32>(id.xy) - source.sample + vec2<i32>(table_size / 2u);
            if any(entry < vec2<i32>(0)) || any(entry >= vec2<i32>(table_size)) {
                continue;
            }
            distance_m = f32(distances[u32(entry.y) * table_size.x + u32(entry.x)]) * params.level_m;
        }
        let behind_m = source.front_m - distance_m;
        if behind_m < 0.0 {
            continue;
        }
        // Without whole turns, as sines are right around 0 only.
        let turns = params.turns_per_m * distance_m - source.phase_turns;
        let wave = sin(TAU * (turns - round(turns)));
        height += source.amplitude_m * exp(-params.beta_per_m * behind_m) * wave;
    }
    heights[index] = height;
}
