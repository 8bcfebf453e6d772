//! What became of the light.

use frame_plan::{DeviceInfo, ExecuteError, Executor, ResourceId, StepTime};
use serde::{Deserialize, Serialize};

use crate::footprint_work::{FootprintWork, WorkBooks};
use crate::passes::deferred_refraction::end_counts;
use crate::passes::gap_fill::{ENERGY_ROWS, ENERGY_WORDS};
use crate::shared::ledger::*;
use crate::shared::photon_queue::{QUEUE_COUNT, QUEUE_DROPPED, QUEUE_HEAD, TILE_TEXELS};

/// Flux of one wavelength in whole units, and the number of photons that carried it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Units; [`LightStatistics::lumens_per_unit`] says what one is.
    pub flux: u64,
    /// Photons that had a part in it; along traced paths one is counted again wherever a part of it ends.
    pub photons: u32,
}

/// The books of one wavelength: `aimed` = `missed` + `blocked` + `emitted`, and `emitted` is the sum of all that follows but
/// `astray` and `beside`, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ledger {
    /// Through the emission view.
    pub aimed: Tally,
    /// What the texel shows first is not glass, or no mirror.
    pub missed: Tally,
    /// Something opaque stands in front of glass.
    pub blocked: Tally,
    /// That met first what its path is for: glass, or of reflected light mirrors.
    pub emitted: Tally,
    /// At the entry, Fresnel.
    pub reflected: Tally,
    /// At the exit, Fresnel: image space follows no internal reflections; where refraction is traced, what is left after the last that is
    /// followed. Of reflected light what goes into glass.
    pub kept_inside: Tally,
    /// In the glass and at its surfaces, or by mirrors.
    pub absorbed: Tally,
    /// On the map.
    pub landed: Tally,
    /// Part of landed: put down away from the surface, image space had not converged.
    pub astray: Tally,
    /// No texel of the map shows the place and side where it arrives.
    pub outside_map: Tally,
    /// Part of outside map: arrives in the plane of a surface, so near to its edge that a splat reaches it, and is put down
    /// there. It makes up for what splats on the surface lose beyond the edge.
    pub beside: Tally,
    /// Leads away from every surface that the light sees.
    pub escaped: Tally,
    /// Total internal reflection, where that is not followed.
    pub total_reflection: Tally,
    /// The interpolated normal sends it through the wrong side of its facet.
    pub wrong_side: Tally,
    /// No back face of a closed refractor in the image, or more reflections in a hollow mirror than are followed.
    pub no_exit: Tally,
}

impl Ledger {
    /// From the words of one wavelength, [`LEDGER_ROWS`] x [`LEDGER_WORDS`].
    pub(crate) fn from_words(words: &[u32]) -> Self {
        let row = |row: usize| {
            let w = &words[LEDGER_WORDS * row..];
            Tally { flux: u64::from(w[0]) | u64::from(w[1]) << 32, photons: w[2] }
        };
        let end = |end: u32| row(LEDGER_FIRST_END + end as usize);
        Self {
            aimed: row(LEDGER_AIMED),
            missed: end(END_MISSED),
            blocked: end(END_BLOCKED),
            emitted: row(LEDGER_EMITTED),
            reflected: row(LEDGER_REFLECTED),
            kept_inside: row(LEDGER_KEPT_INSIDE),
            absorbed: row(LEDGER_ABSORBED),
            landed: end(END_LANDED),
            astray: row(LEDGER_ASTRAY),
            outside_map: end(END_OUTSIDE_MAP),
            beside: row(LEDGER_BESIDE),
            escaped: end(END_ESCAPED),
            total_reflection: end(END_TOTAL),
            wrong_side: end(END_WRONG_SIDE),
            no_exit: end(END_NO_EXIT),
        }
    }

    /// Everything that emitted light can become.
    pub fn accounted(&self) -> u64 {
        [
            self.reflected,
            self.kept_inside,
            self.absorbed,
            self.landed,
            self.outside_map,
            self.escaped,
            self.total_reflection,
            self.wrong_side,
            self.no_exit,
        ]
        .iter()
        .map(|t| t.flux)
        .sum()
    }

    /// Both sums hold.
    pub fn balances(&self) -> bool {
        self.accounted() == self.emitted.flux
            && self.missed.flux + self.blocked.flux + self.emitted.flux == self.aimed.flux
    }
}

/// One light's photons.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LightStatistics {
    /// The light's name.
    pub name: String,
    /// Vacuum wavelengths, nm.
    pub wavelengths_nm: Vec<f64>,
    /// Lumens that one unit of flux stands for at each wavelength.
    pub lumens_per_unit: Vec<f64>,
    /// The books of each wavelength of the light that goes into glass; empty where no such light is traced.
    pub ledgers: Vec<Ledger>,
    /// Those of the light that mirrors, or the outside of glass, throw back; empty where no such light is traced. Nothing is
    /// [`Ledger::reflected`] there: what mirrors do not throw back is `absorbed`, what goes into glass is `kept_inside`.
    pub reflected: Vec<Ledger>,
    /// What adaptive emission looked at, from the coarsest level to tiles of photons; empty for a fixed grid.
    pub levels: Vec<LevelCount>,
    /// What gap filling did to the map, if it was filled.
    pub gap_filling: Option<GapEnergy>,
    /// What footprints took, of the method that lays them.
    pub footprints: Option<FootprintWork>,
}

/// Light of a map before and after gap filling; in pictures that is what surfaces reflect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GapEnergy {
    /// XYZ lumens on the map before; its units are whole, so that what is kept is kept exactly.
    pub before_xyz: [f64; 3],
    /// XYZ lumens after.
    pub after_xyz: [f64; 3],
    /// Texels that hold light before.
    pub lit_before: u64,
    /// Texels that hold light after.
    pub lit_after: u64,
}

/// Adaptive emission at one level of the emission view's mip chain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelCount {
    /// Texels along a cell's side.
    pub cell_texels: u32,
    /// Cells that were looked at.
    pub cells: u32,
    /// Cells that show no glass: nothing below them was looked at.
    pub dropped: u32,
}

/// What became of the wavelengths that a camera sends through glass, by how their ways end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ViewStatistics {
    /// At a background that the picture shows.
    pub seen: u64,
    /// At a surface that something hides in the picture: what hides it is fetched.
    pub hidden: u64,
    /// At a surface that goes on beside the picture: the picture's edge is fetched.
    pub outside_picture: u64,
    /// Past every surface that the picture shows: dark.
    pub nothing: u64,
    /// Totally reflected more often than is followed: dark, but for GLSL's rule.
    pub total_reflection: u64,
    /// No way out in the picture, or out of the wrong side of a facet: dark.
    pub no_exit: u64,
}

/// What a frame did and how long it took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Who did the work.
    pub device: DeviceInfo,
    /// Photons that met what they are for, glass or mirrors, over all wavelengths, lights and paths.
    pub photons: u64,
    /// The lights that had photons.
    pub lights: Vec<LightStatistics>,
    /// The camera's way through glass, where a picture refracts it.
    pub view: Option<ViewStatistics>,
    /// Milliseconds per step; empty where the device cannot measure.
    pub step_times: Vec<StepTime>,
}

/// What the host keeps to read one light's part of the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LightBooks {
    pub(crate) name: String,
    /// First row of refracted light.
    pub(crate) refracted_row: Option<u32>,
    /// First row of reflected light.
    pub(crate) reflected_row: Option<u32>,
    pub(crate) wavelengths_nm: Vec<f64>,
    pub(crate) lumens_per_unit: Vec<f64>,
    /// Levels of adaptive emission.
    pub(crate) levels: u32,
    /// Cells of the coarsest.
    pub(crate) coarsest_cells: u32,
    /// Lumens per unit of the map; none where gaps are not filled.
    pub(crate) lumens_per_map_unit: Option<f64>,
    pub(crate) footprints: Option<WorkBooks>,
}

impl LightBooks {
    fn ledgers(&self, first_row: Option<u32>, words: &[u32]) -> Vec<Ledger> {
        let Some(first_row) = first_row else { return Vec::new() };
        let rows = words.chunks_exact(LEDGER_ROWS * LEDGER_WORDS).skip(first_row as usize);
        rows.take(self.wavelengths_nm.len()).map(Ledger::from_words).collect()
    }

    /// From the rows that gap filling left.
    fn gap_energy(&self, words: &[u32]) -> Option<GapEnergy> {
        let lumens = self.lumens_per_map_unit?;
        let row = |row: usize| {
            let w = &words[ENERGY_WORDS * row..];
            (u128::from(w[0]) | u128::from(w[1]) << 32 | u128::from(w[2]) << 64) as f64
        };
        Some(GapEnergy {
            before_xyz: std::array::from_fn(|c| row(c) * lumens),
            after_xyz: std::array::from_fn(|c| row(3 + c) * lumens),
            lit_before: row(6) as u64,
            lit_after: row(7) as u64,
        })
    }

    /// From the heads of the queues that the levels filled.
    fn level_counts(&self, heads: &[u32]) -> Vec<LevelCount> {
        let head = |level: u32| &heads[level as usize * QUEUE_HEAD..];
        (0..self.levels)
            .map(|level| LevelCount {
                cell_texels: TILE_TEXELS << (self.levels - 1 - level),
                cells: if level == 0 { self.coarsest_cells } else { head(level - 1)[QUEUE_COUNT] },
                dropped: head(level)[QUEUE_DROPPED],
            })
            .collect()
    }
}

/// What the host keeps to read the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Books {
    pub(crate) ledger: Option<ResourceId>,
    /// Heads of the photon queues: light x level.
    pub(crate) queue_heads: Option<ResourceId>,
    /// Energies of gap filling: row x light that it ran for.
    pub(crate) gap_energy: Option<ResourceId>,
    /// Counts of deferred refraction.
    pub(crate) view_counts: Option<ResourceId>,
    /// What footprints took: light x path.
    pub(crate) footprint_work: Option<ResourceId>,
    pub(crate) lights: Vec<LightBooks>,
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
}

impl Books {
    /// The buffers that a frame keeps the books in.
    fn buffers(&self) -> [Option<ResourceId>; 5] {
        [self.ledger, self.queue_heads, self.gap_energy, self.view_counts, self.footprint_work]
    }

    /// Have the books come to the host after every frame, for [`Books::latest`].
    pub(crate) fn watch(&self, executor: &mut dyn Executor) -> Result<(), ExecuteError> {
        let buffers: Vec<_> = self.buffers().into_iter().flatten().collect();
        executor.watch(&buffers)
    }

    /// Of the last frame; waits for it.
    pub(crate) fn read(&self, executor: &mut dyn Executor) -> Result<Statistics, ExecuteError> {
        let mut contents: [Vec<u32>; 5] = Default::default();
        for (words_of, buffer) in contents.iter_mut().zip(self.buffers()) {
            if let Some(buffer) = buffer {
                *words_of = words(&executor.read(buffer)?);
            }
        }
        Ok(self.statistics(&contents, executor))
    }

    /// Of the last frame that is known to have finished; none if there is none yet. Never waits.
    pub(crate) fn latest(&self, executor: &mut dyn Executor) -> Option<Statistics> {
        let mut contents: [Vec<u32>; 5] = Default::default();
        for (words_of, buffer) in contents.iter_mut().zip(self.buffers()) {
            if let Some(buffer) = buffer {
                *words_of = words(executor.latest(buffer)?);
            }
        }
        Some(self.statistics(&contents, executor))
    }

    /// From the words of [`Books::buffers`].
    fn statistics(&self, contents: &[Vec<u32>; 5], executor: &mut dyn Executor) -> Statistics {
        let [ledger, queue_heads, gap_energy, view_counts, footprint_work] = contents;
        let (mut first_head, mut first_row) = (0, 0);
        let lights: Vec<LightStatistics> = self
            .lights
            .iter()
            .map(|light| LightStatistics {
                name: light.name.clone(),
                wavelengths_nm: light.wavelengths_nm.clone(),
                lumens_per_unit: light.lumens_per_unit.clone(),
                ledgers: light.ledgers(light.refracted_row, ledger),
                reflected: light.ledgers(light.reflected_row, ledger),
                levels: {
                    let heads = first_head;
                    first_head += light.levels as usize * QUEUE_HEAD;
                    light.level_counts(&queue_heads[heads..])
                },
                gap_filling: {
                    let row = first_row;
                    first_row += ENERGY_ROWS * usize::from(light.lumens_per_map_unit.is_some());
                    light.gap_energy(&gap_energy[ENERGY_WORDS * row..])
                },
                footprints: light.footprints.map(|books| books.read(footprint_work)),
            })
            .collect();
        let photons = lights
            .iter()
            .flat_map(|l| l.ledgers.iter().chain(&l.reflected))
            .map(|l| u64::from(l.emitted.photons))
            .sum();
        let view = (!view_counts.is_empty()).then(|| {
            let [seen, hidden, outside_picture, nothing, total_reflection, no_exit] = end_counts(view_counts);
            ViewStatistics { seen, hidden, outside_picture, nothing, total_reflection, no_exit }
        });
        let (device, step_times) = (executor.info().clone(), executor.step_times());
        Statistics { device, photons, lights, view, step_times }
    }
}
