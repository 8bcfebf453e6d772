//! Host side of `shaders/shared/footprint.wgsl`, which explains the terms: where a cell of the emission view lands, as a function of
//! place in the cell and of wavelength.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2};

use super::flux::WHOLE;
use super::photon_queue::QUEUE_HEAD;

/// Where a path leads after so many reflections inside; mirrors `PathLanding`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PathLanding {
    /// Texel of the landing view.
    pub texel: Vec2,
    /// Inside `medium`, working units.
    pub length: f32,
    /// Of the path's flux, see [`super::flux::part_from`]; what `medium` absorbs is not yet taken off.
    pub part: u32,
    /// Of all surfaces on the way; equal for paths that belong together.
    pub way: u32,
    /// `END_*`.
    pub end: u32,
    /// Face of the landing view | material of what is lit << 8.
    pub place: u32,
    /// Material.
    pub medium: u32,
}

impl PathLanding {
    /// Of the path's flux.
    pub fn share(&self) -> f32 {
        self.part as f32 / WHOLE as f32
    }

    /// Light between the two lies between their landings.
    pub fn goes_with(&self, other: &Self) -> bool {
        self.way == other.way && self.end == other.end && (self.place ^ other.place) & 0xff == 0
    }
}

/// What a path leaves on its way, as parts of its flux; mirrors `PathEnds`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct PathEnds {
    /// `END_LANDED` where it has landings, otherwise how all of it ends.
    pub end: u32,
    /// At the outside of glass.
    pub reflected: u32,
    /// At surfaces, and in media behind the first.
    pub absorbed: u32,
    /// In glass, after the last reflection that is followed.
    pub kept_inside: u32,
}

/// A cell and the part of the spectrum that it stands for; mirrors `FootprintCell`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FootprintCell {
    /// At its level.
    pub at: UVec2,
    /// Splits in x and y.
    pub level: UVec2,
    /// Bin.
    pub first: u32,
    /// Bins of its range.
    pub bins: u32,
}

/// There is no queue of patches.
pub const NO_QUEUE: u32 = u32::MAX;

/// Of a workgroup: cells, corners of the emission view, or patches of which it takes one cell or one corner each.
pub const CELLS_PER_GROUP: u32 = 64;

/// The node whose paths tell how cells bend, and how those of the others go.
pub fn middle_node(nodes: u32) -> u32 {
    nodes / 2
}

/// No range is split into shorter ones.
pub const LEAST_BINS: u32 = 4;

/// Bins of a spectrum that is split into wavelengths.
pub const SPECTRUM_BINS: u32 = 256;

/// Most nodes of a range.
pub const MOST_NODES: usize = 4;

/// Sixteenths of a range where nodes lie: of all the spectrum about Chebyshev's points of 400 to 700 nm, where nearly all light is
/// seen; of a part of it from end to end, so that what changes between two parts does not go unseen.
pub fn node_sixteenth(nodes: u32, node: u32, bins: u32) -> u32 {
    match nodes {
        1 => 5,
        _ if bins < SPECTRUM_BINS => (16 * node + node / 2) / (nodes - 1),
        2 => 3 + 8 * node,
        3 => 2 + 5 * node,
        _ => 2 + 3 * node + u32::from(node > 1),
    }
}

/// The bin at whose lower end a node of a cell lies.
pub fn node_bin(nodes: u32, node: u32, cell: &FootprintCell) -> u32 {
    cell.first + cell.bins * node_sixteenth(nodes, node, cell.bins) / 16
}

/// Bins of a range before those that a node stands for where nothing can be interpolated.
pub fn share_start(nodes: u32, node: u32, bins: u32) -> u32 {
    match node {
        0 => 0,
        _ if node >= nodes => bins,
        _ => (bins * (node_sixteenth(nodes, node - 1, bins) + node_sixteenth(nodes, node, bins)) + 16) / 32,
    }
}

/// Lagrange's weights at `x` of nodes that lie at `at`; 0 beyond the last.
pub fn node_weights(nodes: usize, at: &[f32; MOST_NODES], x: f32) -> [f32; MOST_NODES] {
    std::array::from_fn(|own| {
        let others = (0..nodes).filter(|other| *other != own);
        let weight = others.fold(1.0, |weight, other| weight * ((x - at[other]) / (at[own] - at[other])));
        if own < nodes { weight } else { 0.0 }
    })
}

/// Counts of what was done stand at the start of the queues, low and high word each: tents put down, and texels that gathered light.
pub const WORK_DEPOSITS: usize = 0;
/// Cells laid down.
pub const WORK_CELLS: usize = 1;
/// Bins of these cells.
pub const WORK_BINS: usize = 2;
/// Corners that paths begin at.
pub const WORK_CORNERS: usize = 3;
/// Paths traced from them.
pub const WORK_RAYS: usize = 4;
/// Number of counts.
pub const WORK_COUNTS: usize = 5;
/// Words of them.
pub const WORK_WORDS: usize = 2 * WORK_COUNTS;

/// Classes of urgency of splits: four of each class of stakes.
pub const CLASSES: usize = 64;

/// Words before a queue's patches: the head of a queue, and how many patches of each class there were to put into it.
pub const PATCHES_HEAD: usize = QUEUE_HEAD + CLASSES;

/// Words of a queued patch.
pub const PATCH_WORDS: usize = 3;

/// Places of a patch: 3 x 3 corners.
pub const PATCH_PLACES: u32 = 9;

/// From one row of them to the next.
pub const PATCH_ROW: u32 = 3;

/// Most cells of a patch.
pub const PATCH_CELLS: u32 = 4;

/// Most corners of a patch that its parent does not have.
pub const PATCH_NEW: u32 = 5;

/// Workgroups for each [`CELLS_PER_GROUP`] patches of a queue: enough for all corners at all nodes, and for all cells and orders.
pub(crate) fn patch_share(nodes: u32, orders: u32) -> u32 {
    PATCH_NEW * nodes.max(orders)
}

/// What a cell is split into: cells in x and y, or the cell itself with a part of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// The cell that is split; with its part of the range where that is.
    pub cell: FootprintCell,
    /// Cells in x and y, 1 or 2; 1 x 1 where the range is split.
    pub parts: UVec2,
    /// Place of the split cell's first corner.
    pub parent: u32,
}

impl Patch {
    /// As queued.
    pub fn words(&self) -> [u32; PATCH_WORDS] {
        let FootprintCell { at, level, first, bins } = self.cell;
        let parts = (self.parts.x - 1) << 24 | (self.parts.y - 1) << 25;
        [at.x | at.y << 16, level.x | level.y << 4 | first << 8 | bins.ilog2() << 20 | parts, self.parent]
    }

    /// From a queue.
    pub fn from_words(words: [u32; PATCH_WORDS]) -> Self {
        let cell = FootprintCell {
            at: UVec2::new(words[0] & 0xffff, words[0] >> 16),
            level: UVec2::new(words[1] & 0xf, words[1] >> 4 & 0xf),
            first: words[1] >> 8 & 0xfff,
            bins: 1 << (words[1] >> 20 & 0xf),
        };
        let parts = UVec2::new(1 + (words[1] >> 24 & 1), 1 + (words[1] >> 25 & 1));
        Self { cell, parts, parent: words[2] }
    }

    /// All its cells as one of its corners counts them: a cell of the patch's own level.
    pub fn cell(&self, child: u32) -> FootprintCell {
        let at = self.parts * self.cell.at + UVec2::new(child % self.parts.x, child / self.parts.x);
        FootprintCell { at, level: self.cell.level + self.parts - 1, ..self.cell }
    }

    /// Number of its cells.
    pub fn cells(&self) -> u32 {
        self.parts.x * self.parts.y
    }

    /// The corners that are traced for it, and none beyond them.
    pub fn new_corner(&self, i: u32) -> Option<UVec2> {
        const INNER: [(u32, u32); PATCH_NEW as usize] = [(1, 0), (1, 1), (0, 1), (2, 1), (1, 2)];
        let (x, y) = match (self.parts.x, self.parts.y) {
            (1, 1) => (i & 1, i >> 1),
            (2, 1) => (1, i),
            (1, 2) => (i, 1),
            _ => INNER[i as usize],
        };
        (x <= self.parts.x && y <= self.parts.y).then_some(UVec2::new(x, y))
    }

    /// Whether its outer corners are its parent's.
    pub fn has_parent(&self) -> bool {
        self.cells() > 1
    }
}

impl FootprintCell {
    /// A corner, texels of the emission view.
    pub fn corner(&self, corner: u32) -> Vec2 {
        let at = self.at + UVec2::new(corner & 1, corner >> 1);
        at.as_vec2() / (UVec2::ONE << self.level).as_vec2() + 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_interpolate_polynomials_of_their_degree() {
        let nodes_of = |bins| (1..=MOST_NODES as u32).map(move |nodes| (nodes, bins));
        for (nodes, bins) in nodes_of(LEAST_BINS).chain(nodes_of(SPECTRUM_BINS)) {
            let count = nodes as usize;
            let at = std::array::from_fn(|n| node_sixteenth(nodes, n as u32, bins) as f32 / 16.0);
            for x in [0.0_f32, 0.03, 0.23, 0.5, 0.99, 1.0] {
                for degree in 0..nodes as i32 {
                    let weights = node_weights(count, &at, x);
                    assert!(weights[count..].iter().all(|w| *w == 0.0));
                    let value: f32 = (0..count).map(|n| weights[n] * at[n].powi(degree)).sum();
                    assert!((value - x.powi(degree)).abs() < 1e-5, "{nodes} nodes, x^{degree}: {value}");
                }
            }
        }
    }

    #[test]
    fn shares_of_nodes_make_up_the_range_and_hold_their_nodes() {
        for nodes in 1..=MOST_NODES as u32 {
            for bins in [LEAST_BINS, 64, SPECTRUM_BINS] {
                let cell = FootprintCell { at: UVec2::ZERO, level: UVec2::ZERO, first: 0, bins };
                assert_eq!((share_start(nodes, 0, bins), share_start(nodes, nodes, bins)), (0, bins));
                for node in 0..nodes {
                    let own = node_bin(nodes, node, &cell);
                    let share = share_start(nodes, node, bins)..share_start(nodes, node + 1, bins);
                    assert!(
                        share.contains(&own) || own == bins && share.end == own,
                        "{nodes} nodes of {bins} bins: {own} in {share:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn queued_patches_come_back() {
        let cell =
            FootprintCell { at: UVec2::new(16_383, 77), level: UVec2::new(6, 2), first: 240, bins: 16 };
        for parts in [UVec2::ONE, UVec2::new(2, 1), UVec2::new(1, 2), UVec2::splat(2)] {
            let patch = Patch { cell, parts, parent: 123_456_789 };
            assert_eq!(Patch::from_words(patch.words()), patch);
        }
        assert_eq!(cell.corner(3), Vec2::new(16_384.0 / 64.0 + 0.5, 78.0 / 4.0 + 0.5));
    }

    #[test]
    fn corners_of_a_patch_are_new_or_its_parents() {
        let cell = FootprintCell { at: UVec2::new(3, 5), level: UVec2::ONE, first: 0, bins: 256 };
        for (parts, new) in
            [(UVec2::ONE, 4), (UVec2::new(2, 1), 2), (UVec2::new(1, 2), 2), (UVec2::splat(2), 5)]
        {
            let patch = Patch { cell, parts, parent: 0 };
            let mut corners: Vec<_> = (0..PATCH_NEW).filter_map(|i| patch.new_corner(i)).collect();
            assert_eq!(corners.len(), new, "{parts}");
            if patch.has_parent() {
                corners.extend([UVec2::ZERO, parts * UVec2::X, parts * UVec2::Y, parts]);
            }
            corners.sort_by_key(|c| (c.y, c.x));
            corners.dedup();
            assert_eq!(corners.len() as u32, (parts.x + 1) * (parts.y + 1), "{parts}: each once");
            let inside = (0..patch.cells()).map(|child| patch.cell(child).corner(0));
            assert!(
                inside
                    .zip(1..)
                    .all(|(at, _)| at.cmpge(cell.corner(0)).all() && at.cmplt(cell.corner(3)).all())
            );
        }
    }
}
