//! Host side of `shaders/shared/footprint_wide.wgsl`: cells that cover many texels, each of which gathers its light.

use std::sync::atomic::AtomicU32;

use glam::{IVec2, Vec2, Vec3};

use super::flux::{WHOLE, add_64};
use super::footprint::*;
use super::footprint_cells::Emitted;
use super::footprint_landings::*;
use super::footprint_light::*;

/// Texels gather light from triangles that cover at least twice as many.
const LEAST_AREA: f32 = 4.0;

/// And that lie within so many along each side: no invocation goes round for ever.
const MOST_GATHERED: f32 = 40.0;

/// Pieces of a range within which triangles only move along a line.
const PIECES: u32 = 4;

/// Texels take their light just beside their centres: sides of footprints that run through centres are on one side of them.
const BESIDE_CENTRE: Vec2 = Vec2::new(1.37e-3, 0.71e-3);

/// The triangles of a cell, by their corners.
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 3], [0, 3, 2]];

impl Spread {
    /// Both triangles are large and neither is turned over, at any node: texels can gather their light.
    pub fn is_wide(&self, extent: &Extent) -> bool {
        if extent.across.max(extent.down) + extent.along / PIECES as f32 > MOST_GATHERED {
            return false;
        }
        let area = |node: usize, [a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| self.places[corner][node]);
            (b - a).perp_dot(c - a)
        };
        let turned = area(0, TRIANGLES[0]).signum();
        (0..self.nodes).all(|node| TRIANGLES.into_iter().all(|t| turned * area(node, t) >= 2.0 * LEAST_AREA))
    }
}

/// What is left of a piece where a corner's weight, which falls so much over all of it, is not below 0.
fn seen_of([from, to]: [f32; 2], (weight, falls): (f32, f32)) -> [f32; 2] {
    if falls > 0.0 {
        [from, to.min(weight / falls)]
    } else if falls < 0.0 {
        [from.max(weight / falls), to]
    } else if weight < 0.0 {
        [from, from]
    } else {
        [from, to]
    }
}

impl CellLight<'_> {
    /// Where all of a cell lands as one and covers many texels: each gathers the part of the spectrum that its place sees of
    /// the cell's triangles, which move along with the wavelength. Neighbouring cells share corners, so none is seen twice.
    pub fn lay_wide(
        &self,
        spread: &Spread,
        emitted: &Emitted,
        cell_flux: u32,
        first: &PathLanding,
        map: &[AtomicU32],
    ) -> u64 {
        let (face, lit, medium) = (first.place & 0xff, first.place >> 8, first.medium);
        let cell = &emitted.cell;
        let size = self.views[(self.params.map_view + face) as usize].size.as_ivec2();
        let mut deposits = 0;
        let pieces = if spread.nodes == 1 { 1 } else { PIECES };
        for piece in 0..pieces {
            let [from_x, middle_x, to_x] =
                [0.0, 0.5, 1.0].map(|share| (piece as f32 + share) / pieces as f32);
            let [first_bin, end_bin] = [from_x, to_x].map(|x| (self.bin_at(cell, medium, x) + 0.5) as u32);
            let first_bin = first_bin.min(cell.first + cell.bins - 1);
            let passes = self.passes(spread, cell, first_bin, (end_bin - first_bin).max(1), first);
            let at: [Vec2; 4] = std::array::from_fn(|corner| spread.place_at(corner, middle_x));
            let moves: [Vec2; 4] =
                std::array::from_fn(|corner| spread.place_at(corner, to_x) - spread.place_at(corner, from_x));
            for corners in TRIANGLES {
                let [a, b, c] = corners.map(|corner| at[corner]);
                let [pass_a, pass_b, pass_c] = corners.map(|corner| passes[corner]);
                let along = corners.map(|corner| moves[corner]).into_iter().sum::<Vec2>() / 3.0;
                let area = (b - a).perp_dot(c - a);
                let per_texel = cell_flux as f32 / area.abs();
                // Weights of b and c at a place, and how they change along with the wavelength.
                let weights = |p: Vec2| Vec2::new(p.perp_dot(c - a), (b - a).perp_dot(p)) / area;
                let slope = weights(along);
                let reach = 0.5 * along.abs();
                let low = (a.min(b).min(c) - reach).floor().as_ivec2().max(IVec2::ZERO);
                let high = (a.max(b).max(c) + reach).ceil().as_ivec2().min(size);
                for y in low.y..high.y {
                    for x in low.x..high.x {
                        let place = IVec2::new(x, y).as_vec2() + 0.5 + BESIDE_CENTRE;
                        let w = weights(place - a);
                        let of_corners =
                            [(w.x, slope.x), (w.y, slope.y), (1.0 - w.x - w.y, -slope.x - slope.y)];
                        let [from, to] = of_corners.into_iter().fold([-0.5, 0.5], seen_of);
                        if to <= from {
                            continue;
                        }
                        let w = w - 0.5 * (from + to) * slope;
                        let passed = pass_a + w.x * (pass_b - pass_a) + w.y * (pass_c - pass_a);
                        let [start, end] = [from, to].map(|u| {
                            let x = middle_x + u * (to_x - from_x);
                            self.weight_before(self.bin_at(cell, medium, x), lit)
                        });
                        let flux =
                            per_texel * passed.clamp(Vec3::ZERO, Vec3::ONE) * (end - start) / WHOLE as f32;
                        deposits += 1;
                        let texel = (face as i32 * size.y + y) * size.x + x;
                        for (c, flux) in flux.to_array().into_iter().enumerate() {
                            let word = 2 * (3 * texel as usize + c);
                            add_64(&map[word..word + 2], (flux.max(0.0) + 0.5) as u64);
                        }
                    }
                }
            }
        }
        deposits
    }
}
