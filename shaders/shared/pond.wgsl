// A pond's grid. Host side: caustic-heightfield's `passes/mod.rs`.

// Samples across a pond, and how far apart they are.
struct PondGrid {
    size: vec2<u32>,     // samples in x and y
    pitch_m: vec2<f32>,
}

fn pond_index(grid: PondGrid, at: vec2<u32>) -> u32 {
    return at.y * grid.size.x + at.x;
}

fn pond_contains(grid: PondGrid, at: vec2<u32>) -> bool {
    return all(at < grid.size);
}
