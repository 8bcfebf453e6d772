//! `--method caustics-map|acm|asm|footprint`: a plan, built for the chosen executor's limits and run once.

use asm_core::{Method, Price, Settings};
use frame_plan::{ExecuteError, Executor, Plan};
use serde_json::Value;
use spectral_scene::{IrradianceMaps, Scene};

use crate::args::RunArgs;
use crate::backend::{self, SCENES};
use crate::error::CliError;
use crate::picture::Picture;
use crate::prices::{self, Frame, Subject};
use crate::progress::Progress;
use crate::stats::{Stopwatch, Work};
use crate::values::Size;

/// Bake onto `receiver`, an index into the scene's objects.
pub(crate) fn bake(
    scene: &Scene,
    receiver: usize,
    size: Size,
    run: &RunArgs,
    times: &mut Stopwatch,
) -> Result<(IrradianceMaps, Work), CliError> {
    let mut chosen = backend::choose(&run.device, &SCENES)?;
    let executor = chosen.executor.as_mut();
    times.did("open_device");
    let subject = Subject { scene, receiver, frame: Frame::Bake(size) };
    let (settings, price) = settings(run, Some(&subject), executor, times)?;
    let size = [size.width, size.height];
    let bake =
        asm_core::bake_plan(scene, receiver, size, &settings, &executor.limits()).map_err(CliError::plan)?;
    let (maps, statistics) =
        execute(settings.method, executor, &bake.plan, times, |executor| bake.read(executor))?;
    let work = Work::new(executor.info().clone(), chosen.reason, &settings, &statistics, &Value::Null)?;
    Ok((maps, Work { price, ..work }))
}

/// A picture by `camera`, an index into the scene's cameras.
pub(crate) fn render(
    scene: &Scene,
    camera: usize,
    size: Size,
    run: &RunArgs,
    times: &mut Stopwatch,
) -> Result<(Picture, Work), CliError> {
    let mut chosen = backend::choose(&run.device, &SCENES)?;
    let executor = chosen.executor.as_mut();
    times.did("open_device");
    let receiver = scene.receiver("receiver").ok().or_else(|| scene.receivers().next());
    let subject =
        receiver.map(|receiver| Subject { scene, receiver, frame: Frame::Picture { camera, size } });
    let (settings, price) = settings(run, subject.as_ref(), executor, times)?;
    let pixels = [size.width, size.height];
    let render = asm_core::render_plan(scene, camera, pixels, &settings, &executor.limits())
        .map_err(CliError::plan)?;
    let (picture, statistics) =
        execute(settings.method, executor, &render.plan, times, |executor| render.read(executor))?;
    let work = Work::new(executor.info().clone(), chosen.reason, &settings, &statistics, &Value::Null)?;
    Ok((Picture { size, xyz: picture.xyz }, Work { price, ..work }))
}

/// Those of the options, or those of the rung that fits a wish, with its price.
fn settings(
    run: &RunArgs,
    subject: Option<&Subject<'_>>,
    executor: &mut dyn Executor,
    times: &mut Stopwatch,
) -> Result<(Settings, Option<Price>), CliError> {
    let Some(wish) = run.price.wish() else {
        let method = run.method.planned().unwrap_or_default();
        return Ok((run.plan.settings(method, run.wavelengths, run.bounces), None));
    };
    let subject = subject.ok_or_else(|| {
        CliError::failed("the scene has no opaque object with texture coordinates to take errors on")
    })?;
    let price = prices::settle(wish, subject, run, executor)?;
    times.did("prices");
    Ok((price.rung.settings(), Some(price)))
}

/// Run one frame and read what it left: only then is a GPU known to be done.
fn execute<T>(
    method: Method,
    executor: &mut dyn Executor,
    plan: &Plan,
    times: &mut Stopwatch,
    read: impl FnOnce(&mut dyn Executor) -> Result<T, ExecuteError>,
) -> Result<T, CliError> {
    times.did("plan");
    let _progress = Progress::spinner(&format!("{} on {}", method.name(), executor.info().device));
    executor.prepare(plan).map_err(CliError::failed)?;
    times.did("prepare");
    executor.execute().map_err(CliError::failed)?;
    let result = read(executor).map_err(CliError::failed)?;
    times.did("execute");
    Ok(result)
}
