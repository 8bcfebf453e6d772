//! Floors as plans, in f32, on the executor that the options ask for.

use std::cell::RefCell;

use caustic_heightfield::{HeightField, PlanSettings, Pond, PondPlan, PondScene};
use frame_plan::Executor;
use serde_json::{Value, json};

use super::floors::{Floor, FloorChoice, Floors};
use super::method::{MethodArgs, Prepared};
use super::water::{Water, height_source};
use crate::backend::{self, Chosen, PONDS, Programs};
use crate::choices::PondMethod;
use crate::error::CliError;
use crate::messages;

impl MethodArgs {
    /// The method in f32: as a plan, prepared where the options say, unless the lobe is splatted, which no plan does.
    pub(super) fn planned(
        &self,
        choice: &FloorChoice,
        scene: &PondScene,
        examples: &[HeightField],
        pond: &Pond,
    ) -> Result<Prepared, CliError> {
        let settings = PlanSettings { heights: height_source(scene), ..PlanSettings::default() };
        if choice.method == PondMethod::Convolution {
            let method = choice.convolution::<f32>(&examples[0], pond).map_err(CliError::failed)?;
            let plan = method.plan(&settings).map_err(CliError::failed)?;
            return self.prepared(plan, json!({ "kernel_samples": choice.kernel }));
        }
        let method = choice.lobe_sum::<f32>(examples, pond).map_err(CliError::failed)?;
        if let Some(terms) = method.terms() {
            let plan = terms.plan(&settings).map_err(CliError::failed)?;
            return self.prepared(plan, json!(method.report()));
        }
        if let Some(option) = self.device.given() {
            return Err(CliError::failed(format!(
                "{option}: this lobe is splatted, which is no plan yet; leave {option} out, or ask for a larger --error"
            )));
        }
        Ok(Floors::from(method).into())
    }

    /// What the options ask for, for these programs; `details` says what it is.
    pub(super) fn executor(
        &self,
        programs: &Programs,
        details: &mut Value,
    ) -> Result<Box<dyn Executor>, CliError> {
        let Chosen { executor, reason } = backend::choose(&self.device, programs)?;
        let info = executor.info();
        details["backend"] = json!(info.executor);
        details["backend_reason"] = json!(reason);
        details["device"] = json!(info.device);
        details["driver"] = json!(info.driver);
        Ok(executor)
    }

    fn prepared(&self, plan: PondPlan, mut details: Value) -> Result<Prepared, CliError> {
        let is_kept =
            plan.plan.decisions.iter().any(|decision| decision.pass == "pond_heights" && decision.kept);
        details["heights_by"] = json!(if is_kept { "plan" } else { "host" });
        let mut executor = self.executor(&PONDS, &mut details)?;
        executor.prepare(&plan.plan).map_err(CliError::failed)?;
        let executor = RefCell::new(executor);
        let floor = move |water: &Water<'_>| {
            let mut executor = executor.borrow_mut();
            water.write(&plan, executor.as_mut())?;
            executor.execute()?;
            let frame = plan.read(executor.as_mut())?;
            if frame.upward_beams > 0 {
                messages::warn(&format!(
                    "{} beams do not travel downwards, and are dark",
                    frame.upward_beams
                ));
            }
            Ok(Floor { outside: frame.outside_states, ..frame.light.into() })
        };
        Ok(Prepared { details, floor: Box::new(floor) })
    }
}
