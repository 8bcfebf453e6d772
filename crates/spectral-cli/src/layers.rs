//! A bake's layers as maps to compare.

use crate::metrics::Map;
use spectral_scene::IrradianceMaps;

/// Light by its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Met nothing.
    Direct,
    /// Has been in glass.
    Refracted,
    /// Met mirrors, and glass only from outside.
    Reflected,
}

/// A layer with less of a bake's total Y counts as not there: nothing can be said about so little light.
const NEGLIGIBLE: f64 = 1e-4;

impl Layer {
    /// Every layer of a bake.
    pub const ALL: [Self; 3] = [Self::Direct, Self::Refracted, Self::Reflected];

    /// As the EXR's channels call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Refracted => "refracted",
            Self::Reflected => "reflected",
        }
    }

    /// This layer of a bake.
    pub fn of(self, maps: &IrradianceMaps) -> Map<'_> {
        let xyz = match self {
            Self::Direct => &maps.direct,
            Self::Refracted => &maps.refracted,
            Self::Reflected => &maps.reflected,
        };
        Map { size: size(maps), xyz }
    }

    /// Where the caustic is: light by way of glass; where there is none, that by way of mirrors; else what there is. None of a
    /// black bake.
    pub fn of_caustic(maps: &IrradianceMaps) -> Option<Self> {
        [Self::Refracted, Self::Reflected, Self::Direct].into_iter().find(|layer| !layer.is_negligible(maps))
    }

    /// Whether the bake has next to nothing in this layer.
    pub fn is_negligible(self, maps: &IrradianceMaps) -> bool {
        let all: f64 = Self::ALL.iter().map(|layer| layer.of(maps).total_y()).sum();
        // NaN is not negligible.
        self.of(maps).total_y() <= NEGLIGIBLE * all
    }
}

/// Texels across and down.
pub fn size(maps: &IrradianceMaps) -> [usize; 2] {
    [maps.width as usize, maps.height as usize]
}

/// All layers together.
pub fn total(maps: &IrradianceMaps) -> Vec<[f32; 3]> {
    let layers = maps.direct.iter().zip(&maps.refracted).zip(&maps.reflected);
    layers.map(|((d, r), s)| std::array::from_fn(|c| d[c] + r[c] + s[c])).collect()
}
