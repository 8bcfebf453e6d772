// The map's 64-bit fixed point as floats. Host side: `passes/map_resolve.rs`.

struct MapResolve {
    view: u32,    // the map's first view
    faces: u32,
    scale: f32,   // light per unit of flux in a texel as large as `scale_view`'s: XYZ lux for parallel rays, candela for an eye's
    power: f32,   // Shah's artistic exponent; 1 keeps energy
    first_texel: u32, // of this path, in `caustic`
    scale_view: u32, // first of as many views
    reserved0: u32,
    reserved1: u32,
}

@group(0) @binding(0) var<uniform> params: MapResolve;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read> map: array<u32>;
@group(0) @binding(3) var<storage, read_write> caustic: array<vec4<f32>>;

@compute @workgroup_size(8, 8, 1)
fn map_resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = views[params.view + min(id.z, params.faces - 1u)];
    if id.x >= view.size.x || id.y >= view.size.y || id.z >= params.faces {
        return;
    }
    let index = (id.z * view.size.y + id.y) * view.size.x + id.x;
    let size = views[params.scale_view + id.z].texel_slope / view.texel_slope;
    let scale = params.scale * (size.x * size.y) / view_texel_measure(view, id.xy);
    var xyz = vec3<f32>(0.0);
    for (var c = 0u; c < 3u; c++) {
        let word = 2u * (3u * index + c);
        xyz[c] = (f32(map[word + 1u]) * 4294967296.0 + f32(map[word])) * scale;
    }
    if params.power != 1.0 {
        xyz = pow(xyz, vec3<f32>(params.power));
    }
    caustic[params.first_texel + index] = vec4<f32>(xyz, 0.0);
}
