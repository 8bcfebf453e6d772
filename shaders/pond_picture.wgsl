// The light on the floor as a picture: XYZ in the colour of the light. Host side: `passes/pond_picture.rs`.

struct PondPicture {
    grid: PondGrid,
    white_xyz: vec3<f32>, // of light with Y = 1
    reserved: u32,
}

@group(0) @binding(0) var<uniform> params: PondPicture;
@group(0) @binding(1) var<storage, read> irradiance: array<f32>;
@group(0) @binding(2) var<storage, read_write> picture: array<vec4<f32>>; // XYZ and padding

@compute @workgroup_size(8, 8, 1)
fn pond_picture(@builtin(global_invocation_id) id: vec3<u32>) {
    if pond_contains(params.grid, id.xy) {
        let index = pond_index(params.grid, id.xy);
        picture[index] = vec4<f32>(params.white_xyz * irradiance[index], 0.0);
    }
}
