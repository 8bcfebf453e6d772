//! What a window shows, behind one seam: [`crate::scene`], [`crate::pond`] and [`crate::relit`] are on the other side of it.

use asm_core::Picture;
use asm_wgpu::wgpu;
use egui::{Key, Painter, Rect, Ui};
use frame_plan::{Decision, DeviceInfo, Executor, Made, StepTime};

use crate::graphics::Graphics;
use crate::hand::Touch;
use crate::maker::Maker;
use crate::runner::{Place, Runner};
use crate::showing::Showing;
use crate::worker::Wake;

/// A picture to be made.
pub(crate) trait Job: Clone + PartialEq + Send + 'static {
    /// What is known of a picture besides who made it and how long that took.
    type Facts: Default + Send + 'static;

    /// Pixels.
    fn size(&self) -> [u32; 2];
}

/// What is known of a picture that was made.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report<F> {
    /// Who made it.
    pub(crate) device: DeviceInfo,
    /// How long each step took; of an earlier frame where the device works behind the host's back.
    pub(crate) step_times: Vec<StepTime>,
    /// Which passes ran, which did not, and why.
    pub(crate) decisions: Vec<Decision>,
    /// What the executor has allocated and compiled so far.
    pub(crate) made: Made,
    /// What there is to know besides.
    pub(crate) facts: F,
}

impl<F> Report<F> {
    /// Of the frame that `executor` has run last.
    pub(crate) fn of(executor: &mut dyn Executor, decisions: Vec<Decision>, facts: F) -> Self {
        let (device, step_times, made) = (executor.info().clone(), executor.step_times(), executor.made());
        Self { device, step_times, decisions, made, facts }
    }
}

/// Something that a window shows and a user changes: its state, without a window, and who makes its pictures.
pub(crate) trait Subject {
    /// Its pictures.
    type Job: Job;
    /// Keys that it knows besides those of every window.
    const KEYS: &'static [Key];
    /// How its pictures are enlarged to the screen.
    const FILTER: wgpu::FilterMode;
    /// What [`Subject::reset`] does, for whom rests the pointer on it.
    const RESET_HINT: &'static str;

    /// What every window has.
    fn showing(&self) -> &Showing;
    /// The same, to be changed.
    fn showing_mut(&mut self) -> &mut Showing;
    /// Who is to make its pictures, and where: wgpu within the window's frames.
    fn place(&self) -> Place {
        let runner = self.showing().runner;
        Place { runner, inside: runner == Runner::Wgpu }
    }
    /// What makes its pictures there; `wake` is told of those that are made beside the window.
    fn maker(&self, graphics: &Graphics, wake: Wake) -> Maker<Self::Job>;
    /// The picture to make for an area of the screen, pixels.
    fn job(&self, area: [u32; 2]) -> Self::Job;
    /// Let so many seconds pass.
    fn advance(&mut self, seconds: f64);
    /// Back to where it began.
    fn reset(&mut self);
    /// Press one of its keys.
    fn press(&mut self, key: Key);
    /// The part of the stage that its picture covers, points.
    fn picture_in(&self, stage: Rect) -> Rect {
        stage
    }
    /// The user's hand on the stage.
    fn touch(&mut self, touch: Touch, stage: Rect);
    /// Scroll up over the picture by so many points.
    fn scroll(&mut self, _points: f64) {}
    /// Whether a picture of this is wanted back from the device that made it.
    fn wants(&self, _job: &Self::Job) -> bool {
        false
    }
    /// A picture that is there.
    fn take(&mut self, _job: &Self::Job, _picture: &Picture) {}
    /// Controls of how pictures are made: rows of a grid with two columns.
    fn choices(&mut self, ui: &mut Ui);
    /// Controls of what there is to see: more such rows.
    fn stage_controls(&mut self, ui: &mut Ui);
    /// What is known of its pictures, below their times.
    fn tell(&self, ui: &mut Ui, facts: &<Self::Job as Job>::Facts);
    /// What lies over the picture.
    fn paint_over(&self, _painter: &Painter, _picture: Rect) {}
}
