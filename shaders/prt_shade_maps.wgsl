// Relit surfaces, some of which have a spectrum at every texel. Host side: `passes/prt_shade_maps.rs`.

// Of each map, for each block and colour-matching function, a layer of four terms.
@group(0) @binding(10) var spectral_maps: texture_2d_array<f32>;

// Texels and weights of bilinear interpolation; the map goes on beyond its edges.
struct Taps {
    low: vec2<u32>,
    high: vec2<u32>,
    share: vec2<f32>, // of `high`
}

fn taps_at(uv: vec2<f32>, size: vec2<u32>) -> Taps {
    let place = fract(uv) * vec2<f32>(size) + (vec2<f32>(size) - 0.5);
    let low = vec2<u32>(place);
    return Taps(low % size, (low + 1u) % size, fract(place));
}

fn terms_at(taps: Taps, layer: u32) -> vec4<f32> {
    let low = vec2<i32>(taps.low);
    let high = vec2<i32>(taps.high);
    let above = mix(
        textureLoad(spectral_maps, low, layer, 0),
        textureLoad(spectral_maps, vec2<i32>(high.x, low.y), layer, 0),
        taps.share.x,
    );
    let below = mix(
        textureLoad(spectral_maps, vec2<i32>(low.x, high.y), layer, 0),
        textureLoad(spectral_maps, high, layer, 0),
        taps.share.x,
    );
    return mix(above, below, taps.share.y);
}

fn reflected(seen: Seen, albedo: PrtAlbedo) -> vec3<f32> {
    if albedo.spectral == 0u {
        return reflected_by_palette(seen, albedo);
    }
    let taps = taps_at(seen.uv, albedo.map_size);
    var xyz = vec3<f32>(0.0);
    for (var block = 0u; block < params.blocks; block++) {
        let e = irradiance_at(seen, block);
        let layer = albedo.first + 3u * block;
        xyz += vec3<f32>(
            dot(terms_at(taps, layer), e),
            dot(terms_at(taps, layer + 1u), e),
            dot(terms_at(taps, layer + 2u), e),
        );
    }
    return xyz;
}

@compute @workgroup_size(8, 8, 1)
fn prt_shade_maps(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < params.size.x && id.y < params.size.y {
        picture[id.y * params.size.x + id.x] = shaded(id.xy);
    }
}
