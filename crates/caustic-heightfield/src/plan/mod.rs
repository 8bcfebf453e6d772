//! The light on the floor as a plan: what the methods of this crate compute, as passes for every executor, in f32.
//!
//! ```text
//! impulses --pond_heights--> heights --pond_relief--> relief
//!                               |                       |
//!                               +-----pond_surface------+--> beams --pond_product or pond_coefficients--> terms
//! terms, kernels --pond_convolve, or pond_fft, pond_spectrum, pond_fft and pond_crop--> irradiance --pond_picture--> picture
//! ```
//!
//! A plan is made once. A frame only replaces heights or the list of impulses, the light, and what it is refracted by.

mod convolve;
mod frame;
mod refit;
mod spectra;
mod surface;

use frame_plan::{Decision, ParamsId, PassStep, Plan, Resource, ResourceId, Step};

use crate::convolve::{Sample, TermSum};
use crate::error::PondError;
use crate::height_field::HeightField;
use crate::low_rank::table::Table;
use crate::passes::pond_picture::PondPicture;
use crate::passes::pond_product::PondProduct;
use crate::passes::pond_relief::RELIEF_WORDS;
use crate::passes::report::REPORT_WORDS;
use crate::passes::{PondGrid, groups_of_grid, groups_of_samples};
use crate::pond::{Illumination, Pond};
use convolve::Kernels;
pub use frame::PondFrame;

/// Where a plan's heights come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HeightSource {
    /// The host writes them: [`PondPlan::write_heights`].
    #[default]
    Host,
    /// A pass makes them of impulses: [`PondPlan::write_impulses`].
    Impulses {
        /// Room for so many impulses and images, 1 to [`HeightSource::MOST_IMPULSES`].
        capacity: usize,
        /// Levels of the table T(u, v) that distances are looked up in, as the paper has it; evaluated if there is none.
        distance_levels: Option<usize>,
    },
}

impl HeightSource {
    /// Most impulses and images.
    pub const MOST_IMPULSES: usize = 1 << 20;
}

/// What a plan is made with, besides the method.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanSettings {
    /// Where heights come from.
    pub heights: HeightSource,
    /// Entries of the tables that Gamma and T are looked up in, as the paper has it; evaluated if there are none.
    pub refraction_entries: Option<usize>,
    /// The colour of the light, CIE 1931 XYZ with Y = 1, if the floor is to be made a picture in it, too, for a host that shows it where it
    /// is: [`PondPlan::picture`].
    pub picture: Option<[f64; 3]>,
    /// Room for low-rank terms of other light ([`crate::LowRank::refit`]): no more than the plan's own if nothing is said.
    pub room: Room,
}

/// What low-rank terms of other light may take. All terms that there is room for are convolved in every frame, used or not; the rest of the
/// room takes no time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Room {
    /// Terms; a plan has at least those it is made with.
    pub terms: usize,
    /// States in the table of their coefficients, likewise.
    pub states: usize,
    /// Offsets of a kernel that is summed in space, likewise. They are summed in as many parts as the first kernels need, so kernels that need
    /// more parts have no room, whatever this says.
    pub offsets: usize,
}

/// What a plan needs to know of a method.
pub(crate) struct Method<'a, T: Sample> {
    pub(crate) pond: &'a Pond,
    pub(crate) extent_m: [f64; 2],
    /// Ponds on each side that are summed over, and the share beyond.
    pub(crate) tiles: (i64, f64),
    /// Coefficients of low-rank terms; none for the paper's three.
    pub(crate) table: Option<&'a Table<T>>,
    pub(crate) terms: &'a TermSum<T>,
}

/// A method of this crate as a plan. It starts with water at rest.
#[derive(Clone, Debug)]
pub struct PondPlan {
    /// For [`frame_plan::Executor::prepare`], with [`crate::PASSES`].
    pub plan: Plan,
    pond: Pond,
    size: [usize; 2],
    extent_m: [f64; 2],
    tiles: (i64, f64),
    settings: PlanSettings,
    ids: Ids,
    kernels: Kernels,
    /// Terms that are convolved, those that are only room too.
    terms: usize,
}

/// What frames write and read.
#[derive(Clone, Copy, Debug)]
struct Ids {
    heights: ResourceId,
    illumination: ResourceId,
    refraction_table: ResourceId,
    irradiance: ResourceId,
    picture: Option<ResourceId>,
    report: ResourceId,
    surface: ParamsId,
    /// Impulses and the blocks that say which of them an iteration takes.
    impulses: Option<(ResourceId, ParamsId)>,
    /// Coefficients of low-rank terms, and the parameters of the pass that looks them up.
    coefficients: Option<(ResourceId, ParamsId)>,
}

impl PondPlan {
    pub(crate) fn new<T: Sample>(method: &Method<'_, T>, settings: &PlanSettings) -> Result<Self, PondError> {
        let size = method.terms.size;
        let at_rest = HeightField::flat(size, method.extent_m)?;
        method.pond.check(&at_rest)?;
        let samples = at_rest.heights_m.len();
        let grid = PondGrid {
            size: size.map(|side| side as u32),
            pitch_m: at_rest.pitch_m().map(|pitch| pitch as f32),
        };
        let mut builder = Builder { plan: Plan { name: "pond".into(), ..Plan::default() }, grid };
        let heights = builder.persistent("heights", samples);
        let impulses = builder.heights(method.extent_m, settings.heights, heights)?;
        let illumination = match &method.pond.illumination {
            Illumination::Uniform(_) => builder.persistent("illumination", 1),
            Illumination::Map(_) => builder.persistent("illumination", samples),
        };
        let entries = surface::check_entries(settings.refraction_entries)?;
        let refraction_table = builder.persistent("refraction_table", 2 * entries.max(1));
        let relief = builder.persistent("relief", RELIEF_WORDS);
        let report =
            builder.plan.add_resource(Resource::buffer("report", 4 * REPORT_WORDS as u64).readable());
        let beams = builder.plan.add_resource(Resource::buffer("beams", 16 * samples as u64));
        builder.clear(relief);
        builder.clear(report);
        builder.relief(method.pond.form, heights, relief);
        let inputs = [heights, illumination, refraction_table, relief];
        let surface = builder.surface(inputs, beams, report);
        let with_room = method.table.and_then(|_| method.terms.with_room(settings.room.terms));
        let terms = with_room.as_ref().unwrap_or(method.terms);
        let (images, coefficients) =
            builder.terms(method, terms.kernels.len(), settings.room.states, [heights, beams, report]);
        let irradiance =
            builder.plan.add_resource(Resource::buffer("irradiance", 4 * samples as u64).readable());
        let kernels = builder.convolve(terms, settings.room.offsets, images, irradiance);
        let picture = settings.picture.map(|white_xyz| builder.picture(irradiance, white_xyz));
        let ids = Ids {
            heights,
            illumination,
            refraction_table,
            irradiance,
            picture,
            report,
            surface,
            impulses,
            coefficients,
        };
        let mut plan = Self {
            plan: builder.plan,
            pond: method.pond.clone(),
            size,
            extent_m: method.extent_m,
            tiles: method.tiles,
            settings: *settings,
            ids,
            kernels,
            terms: terms.kernels.len(),
        };
        plan.start_with_light();
        Ok(plan)
    }
}

/// A plan in the making.
struct Builder {
    plan: Plan,
    grid: PondGrid,
}

impl Builder {
    /// A buffer of so many f32 or u32, which starts with zeros.
    fn persistent(&mut self, name: &str, words: usize) -> ResourceId {
        self.plan.add_resource(Resource::buffer_with(name, &vec![0_u32; words]))
    }

    fn clear(&mut self, buffer: ResourceId) {
        self.plan.steps.push(Step::ClearBuffer { buffer });
    }

    fn decide(&mut self, pass: &str, kept: bool, reason: impl Into<String>) {
        let decision = Decision { pass: pass.into(), kept, reason: reason.into(), notes: Vec::new() };
        self.plan.decisions.push(decision);
    }

    /// The floor as a picture. All light has one index of refraction, and so its own colour everywhere.
    fn picture(&mut self, irradiance: ResourceId, white_xyz: [f64; 3]) -> ResourceId {
        let samples = self.grid.samples() as u64;
        let picture = self.plan.add_resource(Resource::buffer("picture", 16 * samples).readable());
        let white_xyz = white_xyz.map(|w| w as f32);
        let params = PondPicture { grid: self.grid, white_xyz, reserved: 0 };
        let params = self.plan.add_params("pond_picture", &params);
        self.plan.steps.push(Step::Dispatch {
            pass: pass("pond_picture", Some(params), &[irradiance, picture]),
            groups: groups_of_grid(self.grid.size()),
        });
        self.decide("pond_picture", true, "the floor is to be shown");
        picture
    }

    /// The images that are convolved, one per term, and what the coefficients of low-rank ones are looked up in; `terms` and `states` are what
    /// there is to be room for.
    fn terms<T: Sample>(
        &mut self,
        method: &Method<'_, T>,
        terms: usize,
        states: usize,
        [heights, beams, report]: [ResourceId; 3],
    ) -> (ResourceId, Option<(ResourceId, ParamsId)>) {
        let samples = self.grid.samples();
        // An even number: transforms take them in pairs, and the last may be of one and nothing.
        let images = self.persistent("terms", terms.next_multiple_of(2) * samples);
        let groups = groups_of_samples(samples);
        let (step, coefficients) = match method.table {
            None => {
                let params = PondProduct {
                    samples: samples as u32,
                    groups_per_row: groups[0],
                    exponent: (2.0 * method.pond.scattering - 1.0) as f32,
                    reserved: 0,
                };
                let params = self.plan.add_params("pond_product", &params);
                self.decide("pond_product", true, "three terms, those of the paper");
                self.decide("pond_coefficients", false, "terms are the paper's, which need no table");
                (pass("pond_product", Some(params), &[beams, images]), None)
            }
            Some(table) => {
                let params = refit::coefficients(table, terms, samples, method.pond);
                let params = self.plan.add_params("pond_coefficients", &params);
                let mut values = refit::table_values(table, terms);
                values.resize(values.len().max(states * terms), 0.0);
                let coefficients = self.plan.add_resource(Resource::buffer_with("coefficients", &values));
                self.decide("pond_product", false, "terms are low-rank, not the paper's");
                self.decide("pond_coefficients", true, format!("{terms} low-rank terms"));
                let bindings = [heights, beams, coefficients, images, report];
                (pass("pond_coefficients", Some(params), &bindings), Some((coefficients, params)))
            }
        };
        self.plan.steps.push(Step::Dispatch { pass: step, groups });
        (images, coefficients)
    }
}

/// A pass with its resources.
fn pass(name: &str, params: Option<ParamsId>, bindings: &[ResourceId]) -> PassStep {
    PassStep {
        pass: name.into(),
        label: String::new(),
        params,
        bindings: bindings.iter().copied().map(Into::into).collect(),
    }
}
