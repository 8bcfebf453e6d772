//! Host side of `shaders/shared/footprint_landings.wgsl`: where the paths of a cell land.

use std::ops::Deref;

use glam::Vec2;

use super::footprint::*;
use super::footprint_cells::*;
use super::optics::Optics;

/// What passes over landings of cells read.
#[derive(Clone, Copy)]
pub struct Landings<'a> {
    /// The cells.
    pub cells: Cells<'a>,
    /// Path x order.
    pub landings: &'a [PathLanding],
    /// Bin x material that light goes through.
    pub optics: &'a [Optics],
}

impl<'a> Deref for Landings<'a> {
    type Target = Cells<'a>;

    fn deref(&self) -> &Cells<'a> {
        &self.cells
    }
}

/// Where a cell lands, of one order: by corner and node.
pub struct Spread {
    /// Texels of the map.
    pub places: [[Vec2; MOST_NODES]; 4],
    /// Of the paths' flux.
    pub parts: [[f32; MOST_NODES]; 4],
    /// Inside the first glass, working units.
    pub lengths: [[f32; MOST_NODES]; 4],
    /// What the first surface's material lets through or throws back, of nodes.
    pub surfaces: [f32; MOST_NODES],
    /// Of nodes, see [`Landings::abscissa`].
    pub nodes_at: [f32; MOST_NODES],
    /// Number of them.
    pub nodes: usize,
}

/// Texels from one end of a cell to the other.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// From left to right.
    pub across: f32,
    /// From top to bottom.
    pub down: f32,
    /// From one end of its range to the other.
    pub along: f32,
}

/// How a side of a cell lands beyond the straight line, at the middle node.
#[derive(Clone, Copy, Debug, Default)]
pub struct Curve {
    /// Second difference, texels.
    second: Vec2,
    /// How much that changes along the side, the larger part.
    third: f32,
    /// Second difference of the share of the flux that a path leaves here.
    fades: f32,
}

/// All sides of a cell. Neighbours have the side between them in common.
#[derive(Clone, Copy, Debug, Default)]
pub struct Curves {
    /// Upper and lower.
    across: [Curve; 2],
    /// Left and right.
    down: [Curve; 2],
}

/// Cells whose sides land further off than they are interpolated, texels, are split.
pub const MOST_BEND: f32 = 0.1;

/// Where only one second difference is known it may change by so much of itself.
const ONE_SIDED: f32 = 2.0;

/// Of a third difference, half of which is left out at either end, so much lies between the side and what it is taken for; with room
/// for a fourth difference.
const LEFT_OUT: f32 = 1.0 / 64.0;

impl Curves {
    /// How far the sides lie from straight lines, texels.
    pub fn bend(&self) -> Vec2 {
        let most = |[a, b]: &[Curve; 2]| longest(a.second).max(longest(b.second)) / 8.0;
        Vec2::new(most(&self.across), most(&self.down))
    }

    /// How far they may lie from the curves that they are taken for, texels.
    pub fn unevenness(&self) -> Vec2 {
        let most = |[a, b]: &[Curve; 2]| LEFT_OUT * a.third.max(b.third);
        Vec2::new(most(&self.across), most(&self.down))
    }

    /// How much flux, as a share of the path's, may be more or less than is interpolated.
    pub fn fading(&self) -> Vec2 {
        let most = |[a, b]: &[Curve; 2]| a.fades.max(b.fades) / 8.0;
        Vec2::new(most(&self.across), most(&self.down))
    }

    /// Beyond the plane through the corners, at a place in the cell, and how that changes to the right and down.
    pub fn beyond(&self, x: f32, y: f32) -> [Vec2; 3] {
        let across = self.across[0].second.lerp(self.across[1].second, y);
        let down = self.down[0].second.lerp(self.down[1].second, x);
        [-0.5 * (x * (1.0 - x) * across + y * (1.0 - y) * down), (x - 0.5) * across, (y - 0.5) * down]
    }
}

/// Surfaces that leave less count as this.
const LEAST_SURFACE: f32 = 1e-3;

/// The longer side of a box.
pub fn longest(d: Vec2) -> f32 {
    d.abs().max_element()
}

impl Landings<'_> {
    /// Of a corner and a node.
    pub fn path(&self, emitted: &Emitted, corner: u32, node: u32) -> usize {
        let place = emitted.place + (corner & 1) + emitted.row * (corner >> 1);
        (place * self.params.nodes + node) as usize
    }

    /// Of a corner, a node and a number of reflections.
    pub fn landing(&self, emitted: &Emitted, corner: u32, node: u32, order: u32) -> &PathLanding {
        &self.landings[self.path(emitted, corner, node) * self.params.orders as usize + order as usize]
    }

    /// Corners and nodes.
    pub fn paths(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let nodes = self.params.nodes;
        (0..4 * nodes).map(move |path| (path / nodes, path % nodes))
    }

    /// Sums of `APART_*`.
    pub fn belonging(&self, emitted: &Emitted, order: u32) -> u32 {
        let first = self.landing(emitted, 0, 0, order);
        (0..self.params.nodes).fold(TOGETHER, |apart, node| {
            let [upper_left, upper_right, lower_left, lower_right] =
                [0, 1, 2, 3].map(|corner| self.landing(emitted, corner, node, order));
            let flag = |together: bool, flag: u32| if together { 0 } else { flag };
            let rows = upper_left.goes_with(upper_right) && lower_left.goes_with(lower_right);
            let columns = upper_left.goes_with(lower_left) && upper_right.goes_with(lower_right);
            apart
                | flag(rows, APART_IN_X)
                | flag(columns, APART_IN_Y)
                | flag(first.goes_with(upper_left), BANDS_APART)
        })
    }

    /// A place of the landing view on the map.
    pub fn map_texel(&self, face: u32, texel: Vec2) -> Vec2 {
        let shown = &self.views[(self.params.map_view + face) as usize];
        let slope = self.views[(self.params.landing_view + face) as usize].slope(texel);
        let offset = (slope - shown.slope_center) / shown.texel_slope;
        0.5 * shown.size.as_vec2() + Vec2::new(offset.x, -offset.y)
    }

    /// Of a material at a place in the spectrum, as a bin.
    pub fn optics_at(&self, bin: f32, material: u32) -> Optics {
        let params = &self.params;
        let lower = (bin as u32).min(params.bins - 1);
        let row = ((params.first_optics + lower) * params.materials + material) as usize;
        let (a, b) = (&self.optics[row], &self.optics[row + params.materials as usize]);
        let share = bin - lower as f32;
        let between = |a: f32, b: f32| a * (1.0 - share) + b * share;
        Optics {
            index: between(a.index, b.index),
            absorption: between(a.absorption, b.absorption),
            surface: between(a.surface, b.surface),
            reserved: 0.0,
        }
    }

    fn index_at(&self, bin: f32, material: u32) -> f32 {
        self.optics_at(bin, material).index
    }

    /// What landings are interpolated along from one wavelength to another, 0 to 1 within a range: the index of refraction, on
    /// which they depend nearly linearly whatever the glass; without dispersion place in the spectrum.
    pub fn abscissa(&self, cell: &FootprintCell, material: u32, bin: f32) -> f32 {
        let start = self.index_at(cell.first as f32, material);
        let span = self.index_at((cell.first + cell.bins) as f32, material) - start;
        if span.abs() < 1e-6 {
            return (bin - cell.first as f32) / cell.bins as f32;
        }
        (self.index_at(bin, material) - start) / span
    }

    /// The place in the spectrum, as a bin, of an abscissa of a cell's range: two steps of Newton's, since the index is nearly
    /// linear.
    pub fn bin_at(&self, cell: &FootprintCell, material: u32, x: f32) -> f32 {
        let start = self.index_at(cell.first as f32, material);
        let span = self.index_at((cell.first + cell.bins) as f32, material) - start;
        let bin = cell.first as f32 + x * cell.bins as f32;
        if span.abs() < 1e-6 {
            return bin;
        }
        let last = (cell.first + cell.bins - 1) as f32;
        (0..2).fold(bin, |bin, _| {
            let edge = bin.min(last);
            let slope = self.index_at(edge + 1.0, material) - self.index_at(edge, material);
            let off = start + x * span - self.index_at(bin, material);
            let beside = if slope == 0.0 { 0.0 } else { off / slope };
            (bin + beside).clamp(cell.first as f32, last + 1.0)
        })
    }

    /// Second differences of three landings in a row, texels, and of their share of the flux; none where they do not belong together.
    fn second_difference(&self, places: [u32; 3], order: u32) -> Option<(Vec2, f32)> {
        let params = &self.params;
        let path = |place: u32| {
            ((place * params.nodes + middle_node(params.nodes)) * params.orders + order) as usize
        };
        let [a, b, c] = places.map(|place| &self.landings[path(place)]);
        (a.goes_with(b) && b.goes_with(c)).then(|| {
            let fades = a.share() - 2.0 * b.share() + c.share();
            let [a, b, c] = [a, b, c].map(|landing| self.map_texel(landing.place & 0xff, landing.texel));
            (a - 2.0 * b + c, fades.abs())
        })
    }

    /// Of the side of a cell between two corners, as the ones before and behind them tell.
    fn curve(&self, first: u32, step: u32, before: u32, behind: u32, order: u32) -> Curve {
        let difference = |first: u32| self.second_difference([first, first + step, first + 2 * step], order);
        let before = (before > 0).then(|| difference(first - step)).flatten();
        let behind = (behind > 0).then(|| difference(first)).flatten();
        match (before, behind) {
            (Some((a, fades)), Some((b, too))) => {
                Curve { second: 0.5 * (a + b), third: longest(b - a), fades: fades.max(too) }
            }
            (Some((a, fades)), None) | (None, Some((a, fades))) => {
                Curve { second: a, third: ONE_SIDED * longest(a), fades }
            }
            (None, None) => Curve::default(),
        }
    }

    /// Of all four sides.
    pub fn curves(&self, emitted: &Emitted, order: u32) -> Curves {
        let Emitted { place, row, before, behind, .. } = *emitted;
        Curves {
            across: [place, place + row].map(|first| self.curve(first, 1, before.x, behind.x, order)),
            down: [place, place + 1].map(|first| self.curve(first, row, before.y, behind.y, order)),
        }
    }

    /// All landings of an order, on a face.
    pub fn gather(&self, emitted: &Emitted, order: u32, face: u32) -> Spread {
        let (cell, nodes) = (&emitted.cell, self.params.nodes);
        let medium = self.landing(emitted, 0, 0, order).medium;
        let mut spread = Spread {
            places: [[Vec2::ZERO; MOST_NODES]; 4],
            parts: [[0.0; MOST_NODES]; 4],
            lengths: [[0.0; MOST_NODES]; 4],
            surfaces: [1.0; MOST_NODES],
            nodes_at: [0.0; MOST_NODES],
            nodes: nodes as usize,
        };
        for node in 0..nodes {
            let bin = node_bin(nodes, node, cell);
            spread.nodes_at[node as usize] = self.abscissa(cell, medium, bin as f32);
            spread.surfaces[node as usize] = self.optics_at(bin as f32, medium).surface.max(LEAST_SURFACE);
        }
        for (corner, node) in self.paths() {
            let landing = self.landing(emitted, corner, node, order);
            let (c, n) = (corner as usize, node as usize);
            spread.places[c][n] = self.map_texel(face, landing.texel);
            spread.parts[c][n] = landing.share();
            spread.lengths[c][n] = landing.length;
        }
        spread
    }
}

impl Spread {
    /// Lagrange's weights of the nodes at an abscissa.
    pub fn weights(&self, x: f32) -> [f32; MOST_NODES] {
        node_weights(self.nodes, &self.nodes_at, x)
    }

    /// Of a corner, at an abscissa of the range.
    pub fn place_at(&self, corner: usize, x: f32) -> Vec2 {
        self.weights(x).into_iter().zip(self.places[corner]).map(|(weight, place)| weight * place).sum()
    }

    /// As [`Curves::fading`], from one node to the next, beside what the first surface's material does.
    pub fn fading_along(&self) -> f32 {
        if self.nodes < 3 {
            return 0.0;
        }
        let second = |parts: &[f32; MOST_NODES]| {
            let [a, b, c] = [0, middle_node(self.nodes as u32) as usize, self.nodes - 1]
                .map(|node| parts[node] / self.surfaces[node]);
            (a - 2.0 * b + c).abs()
        };
        self.parts.iter().map(second).fold(0.0, f32::max) / 8.0
    }

    /// In texels of the map.
    pub fn extent(&self) -> Extent {
        let (mut across, mut down, mut along) = (0.0_f32, 0.0_f32, 0.0_f32);
        for node in 0..self.nodes {
            let [upper_left, upper_right, lower_left, lower_right] = self.places.map(|corner| corner[node]);
            across = across.max(longest(upper_right - upper_left)).max(longest(lower_right - lower_left));
            down = down.max(longest(lower_left - upper_left)).max(longest(lower_right - upper_right));
        }
        for corner in 0..4 {
            let middle = self.place_at(corner, 0.5);
            let ends = [0.0, 1.0].map(|x| longest(self.place_at(corner, x) - middle));
            along = along.max(ends[0] + ends[1]);
        }
        Extent { across, down, along }
    }
}
