//! Software rasteriser of draw passes.
//!
//! For coverage, vertices are snapped to 1/256 texel and edges are evaluated in integers, so triangles that share an edge
//! cover each texel centre exactly once (top-left rule). Depth and varyings come from the unsnapped vertices. Bands of rows run in parallel; inside a band triangles keep their order, so results
//! do not depend on the number of threads.

use rayon::prelude::*;

use super::clip::{clip, is_inside};
use super::texture::{decode, encode};
use super::{Fragment, MirrorArgs, VertexOutput};
use crate::{Cull, DepthTest, TextureFormat};

/// Bits of a texel's fraction that vertices keep, as on GPUs.
pub(super) const SUBPIXEL_BITS: u32 = 8;
/// Subdivisions of a texel.
const SUBTEXELS: f64 = (1 << SUBPIXEL_BITS) as f64;
/// Triangles whose vertices run as one task.
const TRIANGLES_PER_TASK: usize = 256;
/// Tasks whose results are held at a time.
const TASKS: usize = 64;
/// Rows of a band are at least this many.
const BAND_ROWS: usize = 8;

/// What to draw with: the pass's state and mirrors.
pub(super) struct Drawing<'a> {
    pub(super) args: &'a MirrorArgs<'a>,
    pub(super) vertex: fn(&MirrorArgs<'_>, u32, u32) -> VertexOutput,
    pub(super) fragment: fn(&MirrorArgs<'_>, &Fragment) -> Option<[[f32; 4]; 4]>,
    pub(super) cull: Cull,
    pub(super) depth: Option<DepthTest>,
    pub(super) additive: bool,
}

/// What to draw: a range of vertices per instance and a range of instances.
#[derive(Clone, Copy)]
pub(super) struct Ranges {
    pub(super) vertices: u32,
    pub(super) instances: u32,
    pub(super) first_vertex: u32,
    pub(super) first_instance: u32,
}

/// A colour target's encoded texels.
pub(super) struct ColorTarget<'a> {
    pub(super) format: TextureFormat,
    pub(super) texels: &'a mut [u8],
}

/// Where to draw: all targets have the same size.
pub(super) struct Surface<'a> {
    pub(super) size: [u32; 2],
    pub(super) color: Vec<ColorTarget<'a>>,
    pub(super) depth: Option<&'a mut [u8]>,
}

/// A triangle ready to be scanned; vertices wind clockwise on the screen (y down).
struct Setup {
    /// Snapped, in subtexels.
    x: [i64; 3],
    y: [i64; 3],
    /// Texels.
    exact: [[f64; 2]; 3],
    depth: [f64; 3],
    inverse_w: [f64; 3],
    varyings: [[[f32; 4]; 2]; 3],
    flat: [u32; 4],
    front_facing: bool,
}

/// Memory kept between draws.
#[derive(Default)]
pub(super) struct Scratch {
    tasks: Vec<Vec<Setup>>,
}

impl Scratch {
    /// Memory for draws: enough unless many triangles are cut by the edges of the view.
    pub(super) fn for_draws() -> Self {
        Self { tasks: (0..TASKS).map(|_| Vec::with_capacity(TRIANGLES_PER_TASK)).collect() }
    }

    /// Bytes that it takes.
    pub(super) fn size_bytes(&self) -> u64 {
        self.tasks.iter().map(|setups| (setups.capacity() * size_of::<Setup>()) as u64).sum()
    }
}

/// Rows of all targets that one thread owns.
struct Band<'a> {
    first_row: usize,
    rows: usize,
    color: Vec<ColorTarget<'a>>,
    depth: Option<&'a mut [u8]>,
}

pub(super) fn draw(drawing: &Drawing<'_>, ranges: Ranges, surface: &mut Surface<'_>, scratch: &mut Scratch) {
    let per_instance = u64::from(ranges.vertices / 3);
    let total = per_instance * u64::from(ranges.instances);
    for start in (0..total).step_by(TASKS * TRIANGLES_PER_TASK) {
        scratch.tasks.par_iter_mut().enumerate().for_each(|(task, setups)| {
            setups.clear();
            let first = (start + (task * TRIANGLES_PER_TASK) as u64).min(total);
            for triangle in first..(first + TRIANGLES_PER_TASK as u64).min(total) {
                let instance = ranges.first_instance + (triangle / per_instance) as u32;
                let vertex = ranges.first_vertex + (triangle % per_instance) as u32 * 3;
                let corners = [0, 1, 2].map(|i| (drawing.vertex)(drawing.args, vertex + i, instance));
                set_up(drawing, corners, surface.size, setups);
            }
        });
        let tasks = &scratch.tasks;
        bands(surface).into_par_iter().for_each(|mut band| {
            for setup in tasks.iter().flatten() {
                scan(drawing, setup, &mut band);
            }
        });
    }
}

/// Cut the surface into bands of whole rows.
fn bands<'a>(surface: &'a mut Surface<'_>) -> Vec<Band<'a>> {
    let [width, height] = surface.size.map(|s| s as usize);
    let rows = height.div_ceil(rayon::current_num_threads() * 8).max(BAND_ROWS);
    let mut bands: Vec<Band<'a>> = (0..height)
        .step_by(rows)
        .map(|first_row| Band {
            first_row,
            rows: rows.min(height - first_row),
            color: Vec::new(),
            depth: None,
        })
        .collect();
    for target in &mut surface.color {
        let row_bytes = width * target.format.bytes_per_texel() as usize;
        for (band, texels) in bands.iter_mut().zip(target.texels.chunks_mut(rows * row_bytes)) {
            band.color.push(ColorTarget { format: target.format, texels });
        }
    }
    if let Some(depth) = &mut surface.depth {
        for (band, texels) in bands.iter_mut().zip(depth.chunks_mut(rows * width * 4)) {
            band.depth = Some(texels);
        }
    }
    bands
}

/// Clip, project, snap and cull; what is left is appended.
fn set_up(drawing: &Drawing<'_>, corners: [VertexOutput; 3], size: [u32; 2], setups: &mut Vec<Setup>) {
    let flat = corners[0].flat;
    if corners.iter().all(is_inside) {
        setups.extend(project(drawing, &corners, flat, size));
        return;
    }
    let polygon = clip(corners);
    for i in 2..polygon.len() {
        setups.extend(project(drawing, &[polygon[0], polygon[i - 1], polygon[i]], flat, size));
    }
}

fn project(
    drawing: &Drawing<'_>,
    corners: &[VertexOutput; 3],
    flat: [u32; 4],
    size: [u32; 2],
) -> Option<Setup> {
    let mut setup = Setup {
        x: [0; 3],
        y: [0; 3],
        exact: [[0.0; 2]; 3],
        depth: [0.0; 3],
        inverse_w: [0.0; 3],
        varyings: corners.map(|c| c.varyings),
        flat,
        front_facing: false,
    };
    for (i, corner) in corners.iter().enumerate() {
        let [x, y, z, w] = corner.position.map(f64::from);
        if w <= 0.0 {
            return None;
        }
        let exact = [(x / w * 0.5 + 0.5) * f64::from(size[0]), (0.5 - y / w * 0.5) * f64::from(size[1])];
        setup.exact[i] = exact;
        [setup.x[i], setup.y[i]] = exact.map(|texels| (texels * SUBTEXELS).round_ties_even() as i64);
        setup.depth[i] = z / w;
        setup.inverse_w[i] = 1.0 / w;
    }
    let area = setup.area();
    // Counter-clockwise with y up is clockwise with y down, where this area is negative.
    setup.front_facing = area < 0;
    let dropped = match drawing.cull {
        Cull::None => false,
        Cull::Back => !setup.front_facing,
        Cull::Front => setup.front_facing,
    };
    if area == 0 || dropped {
        return None;
    }
    if area < 0 {
        setup.x.swap(1, 2);
        setup.y.swap(1, 2);
        setup.exact.swap(1, 2);
        setup.depth.swap(1, 2);
        setup.inverse_w.swap(1, 2);
        setup.varyings.swap(1, 2);
    }
    Some(setup)
}

impl Setup {
    /// Twice the signed area in subtexels.
    fn area(&self) -> i64 {
        let ([ax, bx, cx], [ay, by, cy]) = (self.x, self.y);
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    /// Barycentric coordinates on the screen. Snapping may cover a centre just outside the exact triangle: that gets the values
    /// of its border, since slivers would extrapolate far.
    fn weights(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let areas: [f64; 3] = std::array::from_fn(|i| {
            let ([ax, ay], [bx, by]) = (self.exact[(i + 1) % 3], self.exact[(i + 2) % 3]);
            ((bx - ax) * (y - ay) - (by - ay) * (x - ax)).max(0.0)
        });
        let sum: f64 = areas.iter().sum();
        if sum > 0.0 { areas.map(|area| area / sum) } else { [1.0, 0.0, 0.0] }
    }

    /// First and last texel whose centre lies in an interval of subtexels.
    fn texels(coordinates: [i64; 3]) -> (i64, i64) {
        let (sub, half) = (SUBTEXELS as i64, SUBTEXELS as i64 / 2);
        let [a, b, c] = coordinates;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        ((low - half + sub - 1).div_euclid(sub), (high - half).div_euclid(sub))
    }
}

/// Run the fragments of a triangle inside a band.
fn scan(drawing: &Drawing<'_>, setup: &Setup, band: &mut Band<'_>) {
    let (top, bottom) = Setup::texels(setup.y);
    let top = top.max(band.first_row as i64);
    let bottom = bottom.min((band.first_row + band.rows) as i64 - 1);
    if top > bottom {
        return;
    }
    let width = band.width() as i64;
    let (left, right) = Setup::texels(setup.x);
    let (left, right) = (left.max(0), right.min(width - 1));
    let (sub, half) = (SUBTEXELS as i64, SUBTEXELS as i64 / 2);
    // Edge i is opposite vertex i; on a left or top edge the line itself belongs to the triangle.
    let edges: [_; 3] = std::array::from_fn(|i| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (dx, dy) = (setup.x[b] - setup.x[a], setup.y[b] - setup.y[a]);
        let includes_line = dy < 0 || (dy == 0 && dx > 0);
        (setup.x[a], setup.y[a], dx, dy, if includes_line { 0 } else { 1 })
    });
    for y in top..=bottom {
        let py = y * sub + half;
        for x in left..=right {
            let px = x * sub + half;
            if edges.iter().all(|(ax, ay, dx, dy, least)| dx * (py - ay) - dy * (px - ax) >= *least) {
                shade(drawing, setup, band, [x as usize, y as usize]);
            }
        }
    }
}

impl Band<'_> {
    fn width(&self) -> usize {
        let texels = self.color.first().map_or_else(
            || self.depth.as_ref().map_or(0, |d| d.len() / 4),
            |c| c.texels.len() / c.format.bytes_per_texel() as usize,
        );
        texels / self.rows
    }
}

/// Depth test, fragment mirror and output of one texel.
fn shade(drawing: &Drawing<'_>, setup: &Setup, band: &mut Band<'_>, [x, y]: [usize; 2]) {
    let weights = setup.weights([x as f64 + 0.5, y as f64 + 0.5]);
    let sum = |values: [f64; 3]| weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2];
    let depth = sum(setup.depth).clamp(0.0, 1.0) as f32;
    let at = (y - band.first_row) * band.width() + x;
    if let (Some(test), Some(texels)) = (drawing.depth, &band.depth) {
        let held: f32 = bytemuck::pod_read_unaligned(&texels[at * 4..at * 4 + 4]);
        let passes = match test {
            DepthTest::Less => depth < held,
            DepthTest::Greater => depth > held,
        };
        if !passes {
            return;
        }
    }
    let inverse_w = sum(setup.inverse_w);
    let perspective: [f64; 3] = std::array::from_fn(|i| weights[i] * setup.inverse_w[i] / inverse_w);
    let varyings = std::array::from_fn(|v| {
        std::array::from_fn(|c| {
            (0..3).map(|i| perspective[i] * f64::from(setup.varyings[i][v][c])).sum::<f64>() as f32
        })
    });
    let fragment = Fragment {
        position: [x as f32 + 0.5, y as f32 + 0.5, depth, inverse_w as f32],
        front_facing: setup.front_facing,
        flat: setup.flat,
        varyings,
    };
    let Some(values) = (drawing.fragment)(drawing.args, &fragment) else { return };
    for (target, mut value) in band.color.iter_mut().zip(values) {
        let bytes = target.format.bytes_per_texel() as usize;
        let texel = &mut target.texels[at * bytes..(at + 1) * bytes];
        if drawing.additive {
            let held = decode(target.format, texel);
            value = std::array::from_fn(|c| held[c] + value[c]);
        }
        encode(target.format, value, texel);
    }
    if let (Some(_), Some(texels)) = (drawing.depth, &mut band.depth) {
        texels[at * 4..at * 4 + 4].copy_from_slice(&depth.to_le_bytes());
    }
}
