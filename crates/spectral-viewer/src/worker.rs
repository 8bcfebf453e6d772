//! Work on a thread beside the window's: it stays responsive however long a picture, a fit or an exact sum takes.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};

/// Told when something is done.
pub(crate) type Wake = Arc<dyn Fn() + Send + Sync>;

/// Wakes once more when the thread ends: if it panicked, somebody waits for what it was to do.
struct WakeAtEnd(Wake);

impl Drop for WakeAtEnd {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// A thread that does one task after the other: of `T` it makes `O`, or says in a sentence why not.
pub(crate) struct Worker<T, O> {
    /// Taken when the thread is to end.
    tasks: Option<Sender<T>>,
    outcomes: Receiver<Result<O, String>>,
    thread: Option<JoinHandle<()>>,
    busy: bool,
}

impl<T: Send + 'static, O: Send + 'static> Worker<T, O> {
    /// Tasks are done by what `open` opens, on the thread that uses it.
    pub(crate) fn start<W: FnMut(T) -> Result<O, String>>(
        wake: Wake,
        open: impl FnOnce() -> Result<W, String> + Send + 'static,
    ) -> Self {
        let (tasks, to_do) = channel::<T>();
        let (done, outcomes) = channel();
        let thread = thread::spawn(move || {
            let wake = WakeAtEnd(wake);
            // Gone before the last waking, which then finds the channel closed.
            let done = done;
            let mut work = open();
            for task in to_do {
                let outcome = match &mut work {
                    Ok(work) => work(task),
                    Err(reason) => Err(reason.clone()),
                };
                if done.send(outcome).is_err() {
                    return;
                }
                (wake.0)();
            }
        });
        Self { tasks: Some(tasks), outcomes, thread: Some(thread), busy: false }
    }

    /// Whether a task is being done.
    pub(crate) fn is_busy(&self) -> bool {
        self.busy
    }

    /// Have a task done. Call it when none is: they do not overtake each other.
    pub(crate) fn begin(&mut self, task: T) {
        if let Some(tasks) = &self.tasks {
            // A thread that has ended shows in `finished`.
            let _ = tasks.send(task);
            self.busy = true;
        }
    }

    /// What came of the task that was begun, once it is done.
    pub(crate) fn finished(&mut self) -> Option<Result<O, String>> {
        if !self.busy {
            return None;
        }
        let outcome = match self.outcomes.try_recv() {
            Ok(outcome) => outcome,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the thread that makes it has ended".into()),
        };
        self.busy = false;
        Some(outcome)
    }
}

/// A device is not left while it works: drivers take their process down with them.
impl<T, O> Drop for Worker<T, O> {
    fn drop(&mut self) {
        self.tasks = None;
        if let Some(thread) = self.thread.take() {
            // Its panic was told when it happened.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listened() -> (Wake, Receiver<()>) {
        let (told, wakings) = channel();
        (Arc::new(move || told.send(()).expect("the test listens")), wakings)
    }

    #[test]
    fn tasks_are_done_one_after_the_other() {
        let (wake, wakings) = listened();
        let mut worker = Worker::start(wake, || Ok(|task: u32| task.checked_sub(1).ok_or("none".into())));
        assert!(worker.finished().is_none());
        for (task, outcome) in [(3, Ok(2)), (0, Err("none".to_owned())), (1, Ok(0))] {
            worker.begin(task);
            assert!(worker.is_busy());
            wakings.recv().expect("a waking");
            assert_eq!(worker.finished(), Some(outcome));
        }
    }

    #[test]
    fn a_thread_that_panics_tells_who_waits_for_it() {
        let (wake, wakings) = listened();
        let mut worker: Worker<(), ()> = Worker::start(wake, || Ok(|()| panic!("on purpose")));
        worker.begin(());
        wakings.recv().expect("a waking");
        let Some(Err(error)) = worker.finished() else { panic!("neither done nor nothing") };
        assert!(error.contains("ended") && !worker.is_busy(), "{error}");
    }
}
