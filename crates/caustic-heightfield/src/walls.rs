//! Reflections at the walls of the pond, as impulses outside of it (section 4.3 of the paper).

use serde::{Deserialize, Serialize};

use crate::error::PondError;
use crate::impulse::Impulse;

/// Farthest tile whose images are taken.
const MAX_TILES: u32 = 64;

/// Which mirror images of an impulse stand for reflections at the walls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallImages {
    /// None: waves leave the pond.
    None,
    /// One image through each of the four walls, as the paper has it: first reflections, and nothing from corners.
    #[default]
    Four,
    /// All images in the tiles up to this many ponds away in x and y: 1 adds the corners' images to the four, more add
    /// further reflections. A wave that has not left those tiles is reflected exactly.
    Tiles(u32),
}

impl WallImages {
    /// Whether it can be computed.
    ///
    /// # Errors
    /// More than 64 tiles.
    pub fn check(self) -> Result<(), PondError> {
        match self {
            Self::Tiles(tiles) if tiles > MAX_TILES => Err(PondError::Setting {
                name: "tiles of wall images",
                got: f64::from(tiles),
                expected: "0 to 64",
            }),
            _ => Ok(()),
        }
    }
}

/// The impulse and its images. On a wall an image falls onto its original: the wave is twice as high there, as it is on a
/// wall that reflects.
pub fn wall_images(impulse: &Impulse, extent_m: [f64; 2], images: WallImages) -> Vec<Impulse> {
    let tiles = match images {
        WallImages::None => 0,
        WallImages::Four => 1,
        WallImages::Tiles(tiles) => i64::from(tiles),
    };
    let kept = |m: i64, n: i64| images != WallImages::Four || m == 0 || n == 0;
    let place = |k: usize, tile: i64| mirrored(impulse.position_m[k], extent_m[k], tile);
    (-tiles..=tiles)
        .flat_map(|n| (-tiles..=tiles).map(move |m| (m, n)))
        .filter(|&(m, n)| kept(m, n))
        .map(|(m, n)| Impulse { position_m: [place(0, m), place(1, n)], ..*impulse })
        .collect()
}

/// Where a position within 0..`extent` is seen in the tile `tile`: odd tiles are mirrored.
fn mirrored(position: f64, extent: f64, tile: i64) -> f64 {
    let inside = if tile % 2 == 0 { position } else { extent - position };
    inside + tile as f64 * extent
}
