//! `--budget-ms` and `--target-de`: the rung that fits, by what accuracy costs for this scene on this device.
//!
//! The list is measured when it is first asked for, and kept in the user's cache folder by the hash of all it depends on:
//! scene, size, device, program.

mod measure;

use std::time::UNIX_EPOCH;

use asm_core::{Price, PriceList};
use frame_plan::Executor;
use serde::Serialize;
use spectral_scene::Scene;

use crate::args::{PriceOptions, RunArgs};
use crate::backend::cache_folder;
use crate::choices::Method;
use crate::error::CliError;
use crate::kept::{Absent, Kept, Key};
use crate::messages;
use crate::progress::Progress;
use crate::values::Size;
use measure::Effort;

/// What is priced.
#[derive(Clone, Copy)]
pub(crate) struct Subject<'a> {
    pub(crate) scene: &'a Scene,
    /// Where the error is taken, an index into the scene's objects.
    pub(crate) receiver: usize,
    /// What a frame makes.
    pub(crate) frame: Frame,
}

/// What a frame makes.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Frame {
    /// Irradiance of this size.
    Bake(Size),
    /// A picture of this size by a camera, an index.
    Picture { camera: usize, size: Size },
}

/// What the user wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wish {
    /// As good as can be within so many milliseconds.
    BudgetMs(f64),
    /// As fast as can be with at most this mean CIEDE2000.
    TargetDeltaE(f64),
}

impl PriceOptions {
    /// What is wished for, if anything.
    pub(crate) fn wish(&self) -> Option<Wish> {
        self.budget_ms.map(Wish::BudgetMs).or(self.target_de.map(Wish::TargetDeltaE))
    }
}

impl Wish {
    /// The rung to take.
    ///
    /// # Errors
    /// If none fits, with the nearest that there is.
    fn pick(self, list: &PriceList) -> Result<&Price, String> {
        let of = |price: Option<&Price>| price.map_or("there is none at all".to_owned(), words);
        match self {
            Self::BudgetMs(ms) => list.best_within(ms).ok_or_else(|| {
                format!("--budget-ms {ms}: no frame is that quick here; the fastest: {}", of(list.fastest()))
            }),
            Self::TargetDeltaE(target) => list.cheapest_for_error(target).ok_or_else(|| {
                let best = of(list.most_accurate());
                format!("--target-de {target}: no rung comes that near to the oracle; the nearest: {best}")
            }),
        }
    }
}

/// A price for people.
fn words(price: &Price) -> String {
    format!("{}, mean CIEDE2000 {:.2}, {:.1} ms", price.rung, price.delta_e, price.ms)
}

/// The price that fits a wish.
///
/// # Errors
/// If none does, or nothing can be measured.
pub(crate) fn settle(
    wish: Wish,
    subject: &Subject<'_>,
    run: &RunArgs,
    executor: &mut dyn Executor,
) -> Result<Price, CliError> {
    let effort = Effort { threads: run.device.threads, ..Effort::default() };
    let kept = cache_folder().map(|folder| Kept::in_folder(folder.join("prices")));
    let list = list(subject, &effort, executor, kept)?;
    let price = wish.pick(&list).map_err(CliError::failed)?;
    messages::complain(&format!("note: {}", words(price)));
    Ok(price.clone())
}

/// The method of a price, by its name on the command line.
pub(crate) fn method(price: &Price) -> Method {
    let method = Method::ALL.into_iter().find(|method| method.planned() == Some(price.rung.method));
    method.expect("the program has every method of plans")
}

/// Kept or measured.
fn list(
    subject: &Subject<'_>,
    effort: &Effort,
    executor: &mut dyn Executor,
    kept: Option<Kept>,
) -> Result<PriceList, CliError> {
    let name = executor.info().executor.clone();
    let parts = (subject.scene, subject.receiver, subject.frame, executor.info(), effort);
    let key = Key::of(&parts, &program()).map_err(CliError::failed)?;
    match kept.as_ref().map(|kept| kept.read::<PriceList>(&name, &key)) {
        Some(Ok((list, _))) => return Ok(list),
        Some(Err(Absent::Damaged(what))) => messages::warn(&format!("measured again: {what}")),
        Some(Err(Absent::New)) | None => {}
    }
    let (scene, device) = (&subject.scene.name, &executor.info().device);
    messages::complain(&format!(
        "note: measuring what accuracy costs for {scene} on {device}; done once, in a minute or two"
    ));
    let progress = Progress::bar("prices");
    let list = measure::list(subject, effort, executor, &|share| progress.set(share))?;
    drop(progress);
    if let Some(kept) = kept
        && let Err(error) = kept.write(&name, &key, &list, &[])
    {
        messages::warn(&format!("the price list cannot be kept, and is measured again next time: {error}"));
    }
    Ok(list)
}

/// This very program: another build has other prices.
fn program() -> String {
    let built = std::env::current_exe().and_then(|path| path.metadata()).ok().and_then(|file| {
        let modified = file.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        Some((file.len(), modified.as_nanos()))
    });
    format!("{} {built:?}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asm_core::{PASSES, rungs};
    use frame_plan::cpu::CpuExecutor;

    fn list() -> PriceList {
        let figures = [(5.0, 4.0), (20.0, 1.0), (40.0, 0.5)];
        let price = |(rung, (ms, delta_e))| Price { rung, ms, delta_e };
        PriceList { prices: rungs().into_iter().zip(figures).map(price).collect() }
    }

    #[test]
    fn wishes_are_granted_or_say_what_there_is() {
        let list = list();
        let ms = |wish: Wish| wish.pick(&list).map(|price| price.ms);
        assert_eq!(ms(Wish::BudgetMs(30.0)), Ok(20.0));
        assert_eq!(ms(Wish::TargetDeltaE(2.0)), Ok(20.0));
        let error = ms(Wish::BudgetMs(1.0)).expect_err("nothing is that fast");
        assert!(error.contains("--budget-ms 1") && error.contains("5.0 ms"), "{error}");
        let error = ms(Wish::TargetDeltaE(0.1)).expect_err("nothing is that good");
        assert!(error.contains("--target-de 0.1") && error.contains("CIEDE2000 0.50"), "{error}");
        let error = Wish::BudgetMs(1.0).pick(&PriceList::default()).expect_err("empty");
        assert!(error.contains("none at all"), "{error}");
    }

    #[test]
    fn a_list_is_measured_once_for_a_size_and_again_when_it_is_damaged() {
        let scene = spectral_scene::bundled("sphere").expect("a bundled scene");
        let receiver = scene.receiver("receiver").expect("a receiver");
        let rungs = Effort::default().rungs[..1].to_vec();
        let effort = Effort { texels: [32; 2], photons: 1 << 15, rungs, ..Effort::default() };
        let mut executor = CpuExecutor::new(PASSES, None).expect("the CPU");
        let folder = tempfile::tempdir().expect("folder");
        let mut listed = |size: u32| {
            let frame = Frame::Bake(Size { width: size, height: size });
            let subject = Subject { scene: &scene, receiver, frame };
            let kept = Kept::in_folder(folder.path().join("prices"));
            super::list(&subject, &effort, &mut executor, Some(kept)).expect("a list")
        };
        let files = || -> Vec<_> {
            let folder = std::fs::read_dir(folder.path().join("prices")).expect("a folder");
            folder.map(|entry| entry.expect("an entry").path()).collect()
        };
        let first = listed(32);
        // Times are never measured alike twice.
        assert_eq!(listed(32), first);
        assert_eq!(files().len(), 1);
        std::fs::write(&files()[0], "{}").expect("written");
        assert_ne!(listed(32).prices[0].ms, first.prices[0].ms);
        assert_eq!(listed(16).prices[0].delta_e, first.prices[0].delta_e);
        assert_eq!(files().len(), 2);
    }

    #[test]
    fn every_rung_is_of_a_method_of_the_program() {
        for rung in rungs() {
            let (name, planned) = (rung.method.name(), rung.method);
            let method = method(&Price { rung, ms: 1.0, delta_e: 1.0 });
            assert_eq!((method.name(), method.planned()), (name, Some(planned)));
        }
    }
}
