// The floor out of the image that was transformed. Host side: `passes/pond_crop.rs`.

struct PondCrop {
    grid: PondGrid,
    pitch: u32, // points from row to row of the image
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: PondCrop;
@group(0) @binding(1) var<storage, read> image: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> irradiance: array<f32>;

@compute @workgroup_size(8, 8, 1)
fn pond_crop(@builtin(global_invocation_id) id: vec3<u32>) {
    if pond_contains(params.grid, id.xy) {
        irradiance[pond_index(params.grid, id.xy)] = image[id.y * params.pitch + id.x].x;
    }
}
