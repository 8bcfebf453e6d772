//! Clipping of triangles in clip space.

use super::VertexOutput;

/// Triangles may reach this many half-widths out of the picture before they are cut, so that few are.
const GUARD: f32 = 32.0;

/// Signed distances that are negative outside: near, far, and the guard band.
fn distances([x, y, z, w]: [f32; 4]) -> [f32; 6] {
    [z, w - z, GUARD * w - x, GUARD * w + x, GUARD * w - y, GUARD * w + y]
}

/// The vertex needs no clipping.
pub(super) fn is_inside(vertex: &VertexOutput) -> bool {
    distances(vertex.position).iter().all(|&d| d >= 0.0)
}

/// The convex polygon that is left of a triangle; empty if nothing is, or if a coordinate is not a number.
pub(super) fn clip(triangle: [VertexOutput; 3]) -> Vec<VertexOutput> {
    if triangle.iter().any(|v| v.position.iter().any(|c| !c.is_finite())) {
        return Vec::new();
    }
    let mut polygon = triangle.to_vec();
    for plane in 0..6 {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, b) in polygon.iter().enumerate() {
            let a = &polygon[(i + polygon.len() - 1) % polygon.len()];
            let (da, db) = (distances(a.position)[plane], distances(b.position)[plane]);
            // Always from the inside out, so that both triangles at an edge get the same point.
            if da >= 0.0 && db < 0.0 {
                kept.push(between(a, b, da / (da - db)));
            } else if da < 0.0 && db >= 0.0 {
                kept.push(between(b, a, db / (db - da)));
            }
            if db >= 0.0 {
                kept.push(*b);
            }
        }
        polygon = kept;
    }
    polygon
}

fn between(inside: &VertexOutput, outside: &VertexOutput, t: f32) -> VertexOutput {
    let mix = |a: [f32; 4], b: [f32; 4]| std::array::from_fn(|i| a[i] + t * (b[i] - a[i]));
    VertexOutput {
        position: mix(inside.position, outside.position),
        flat: inside.flat,
        varyings: std::array::from_fn(|v| mix(inside.varyings[v], outside.varyings[v])),
    }
}
