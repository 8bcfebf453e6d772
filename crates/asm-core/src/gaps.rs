//! Gap filling: the steps from a light's map to one without gaps between its wavelengths.

use frame_plan::{Bound, ResourceId, Step};
use glam::UVec2;

use crate::caustics::Caustics;
use crate::lights::LightSetup;
use crate::passes::gap_fill::{ENERGY_ROWS, ENERGY_WORDS, GapFill};
use crate::passes::gap_mask::GapMask;
use crate::passes::gap_reach::GapReach;
use crate::resources::Resources;
use crate::shared::gap::{GAP_DISC, GAP_PAPER, GAP_PAPER_LITERAL, disc};
use crate::{GapFilling, PlanError, Settings};

/// Resources of gap filling, which lights use in turn.
pub(crate) struct Gaps {
    offsets: ResourceId,
    offset_count: u32,
    rule: u32,
    mask: ResourceId,
    /// The mask with what is beside gaps, where gaps are looked for.
    reach: Option<ResourceId>,
    /// The map without gaps.
    pub(crate) filled: ResourceId,
    /// Light before and after, per light.
    pub(crate) energy: ResourceId,
}

/// What a light's gap filling works on.
pub(crate) struct GapMaps {
    pub(crate) size: UVec2,
    pub(crate) faces: u32,
    pub(crate) map: ResourceId,
    pub(crate) landing: ResourceId,
    pub(crate) landing_view: u32,
    pub(crate) map_view: u32,
}

impl Gaps {
    /// `None` where no light's map has gaps to fill.
    pub(crate) fn new(
        resources: &mut Resources<'_>,
        settings: &Settings,
        setups: &[LightSetup],
        texels: u64,
    ) -> Result<Option<Self>, PlanError> {
        let lights = setups.iter().filter(|s| s.gaps).count();
        let rule = match settings.gap_filling() {
            GapFilling::None => return Ok(None),
            GapFilling::Paper => GAP_PAPER,
            GapFilling::PaperLiteral => GAP_PAPER_LITERAL,
            GapFilling::Disc => GAP_DISC,
        };
        if lights == 0 {
            return Ok(None);
        }
        let offsets = disc(settings.gap_radius);
        let words = lights * ENERGY_ROWS * ENERGY_WORDS;
        let energy = resources.buffer("gap energy", 4 * words as u64, "lights")?;
        resources.make_readable(energy);
        Ok(Some(Self {
            offset_count: offsets.len() as u32,
            offsets: resources.filled("gap offsets", &offsets)?,
            rule,
            mask: resources.buffer("gap mask", 4 * texels, "map_size")?,
            reach: if rule == GAP_DISC {
                Some(resources.buffer("gap reach", 4 * texels, "map_size")?)
            } else {
                None
            },
            filled: resources.buffer("filled map", 24 * texels, "map_size")?,
            energy,
        }))
    }
}

impl Caustics<'_> {
    /// Steps from a light's map to `gaps.filled`; `light` counts lights that gap filling runs for.
    pub(crate) fn fill_gaps(
        &mut self,
        gaps: &Gaps,
        label: &str,
        light: usize,
        maps: &GapMaps,
    ) -> Result<(), PlanError> {
        let rows = maps.size.y * maps.faces;
        let groups = self.resources.groups([maps.size.x, rows], 1, "map_size")?;
        let mask = GapMask {
            size: maps.size,
            rows,
            rule: gaps.rule,
            threshold: self.settings.gap_threshold,
            offsets: gaps.offset_count,
            landing_view: maps.landing_view,
            map_view: maps.map_view,
        };
        let bindings = [maps.map, gaps.offsets, self.views, maps.landing, gaps.mask];
        self.dispatch("gap_mask", label, &mask, bindings.map(Bound::from).to_vec(), groups);
        if let Some(reach) = gaps.reach {
            let params = GapReach { size: maps.size, rows, offsets: gaps.offset_count };
            let bindings = [gaps.offsets, gaps.mask, reach];
            self.dispatch("gap_reach", label, &params, bindings.map(Bound::from).to_vec(), groups);
        }
        let fill = GapFill {
            size: maps.size,
            rows,
            rule: gaps.rule,
            samples: self.settings.gap_samples,
            threshold: self.settings.gap_threshold,
            offsets: gaps.offset_count,
            // The texel itself keeps an equal share.
            share: 0x1_0000 / (gaps.offset_count + 1),
            first_row: (light * ENERGY_ROWS) as u32,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let mask = gaps.reach.unwrap_or(gaps.mask);
        let bindings = [maps.map, gaps.offsets, mask, gaps.filled, gaps.energy];
        self.resources.plan.steps.push(Step::ClearBuffer { buffer: gaps.filled });
        self.dispatch("gap_fill", label, &fill, bindings.map(Bound::from).to_vec(), groups);
        Ok(())
    }
}
