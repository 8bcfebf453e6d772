// Relit surfaces whose albedos are entries of a palette. Host side: `passes/prt_shade.rs`.

fn reflected(seen: Seen, albedo: PrtAlbedo) -> vec3<f32> {
    return reflected_by_palette(seen, albedo);
}

@compute @workgroup_size(8, 8, 1)
fn prt_shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < params.size.x && id.y < params.size.y {
        picture[id.y * params.size.x + id.x] = shaded(id.xy);
    }
}
