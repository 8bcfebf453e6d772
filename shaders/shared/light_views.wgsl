// Finding points in the views of a light. Host side: asm-core's `shared/light_views.rs`.
//
// A light sees the scene through one view or, where it stands among its receivers, through up to six whose square
// frusta meet at their edges. Expects the global `views`.

struct Located {
    found: bool,
    face: u32,          // which of the views
    view: u32,          // its index in `views`
    texel: vec2<f32>,   // continuous, as in view.wgsl
}

fn locate(first_view: u32, faces: u32, p: vec3<f32>) -> Located {
    for (var face = 0u; face < faces; face++) {
        let view = views[first_view + face];
        let at = view_project(view, p);
        if view_holds(view, at) {
            return Located(true, face, first_view + face, at.texel);
        }
    }
    return Located(false, 0u, first_view, vec2<f32>(0.0));
}

// Where the map of a light holds a point that one of its views from `landing_view` on sees. Maps have a view per face too,
// which may show a part of it only, finer; where it is the same view, it is the same place.
fn on_map(at: Located, landing_view: u32, map_view: u32, p: vec3<f32>) -> Located {
    if map_view == landing_view {
        return at;
    }
    let view = views[map_view + at.face];
    let place = view_project(view, p);
    return Located(at.found && view_holds(view, place), at.face, map_view + at.face, place.texel);
}

// As `locate`, but a point beside a single view is moved to the view's edge.
fn locate_clamped(first_view: u32, faces: u32, p: vec3<f32>) -> Located {
    let exact = locate(first_view, faces, p);
    if exact.found || faces != 1u {
        return exact;
    }
    let view = views[first_view];
    let at = view_project(view, p);
    let last = vec2<f32>(view.size) - 0.5;
    return Located(at.z > 0.0, 0u, first_view, clamp(at.texel, vec2<f32>(0.5), last));
}
