// Which triangle is the first that a view sees at each texel centre. Host side: `passes/visibility.rs`.

struct Visibility {
    view: u32,            // index in `views`
    first_triangle: u32,  // vertex 0 of the draw is its first corner
    faces: u32,           // VISIBILITY_*
    from_distance: f32,   // surfaces nearer to the view's eye or plane are left out; 0 keeps all
}

const VISIBILITY_BACK_FACES: u32 = 1u; // only triangles that face away
const VISIBILITY_ALL_FACES: u32 = 0u;

@group(0) @binding(0) var<uniform> params: Visibility;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;

@vertex
fn visibility_vertex(@builtin(vertex_index) index: u32) -> VisibilityVertex {
    let triangle = params.first_triangle + index / 3u;
    let corner = triangle_corner(triangles[triangle], index % 3u);
    return VisibilityVertex(view_clip(views[params.view], corner), triangle + 1u);
}

@fragment
fn visibility_fragment(
    in: VisibilityVertex,
    @builtin(front_facing) front_facing: bool,
) -> @location(0) u32 {
    if params.faces == VISIBILITY_BACK_FACES && front_facing {
        discard;
    }
    if params.from_distance > 0.0 {
        let hit = plane_hit(triangles[in.visible - 1u], view_ray(views[params.view], in.clip.xy));
        if !hit.crosses || hit.distance < params.from_distance {
            discard;
        }
    }
    return in.visible;
}
