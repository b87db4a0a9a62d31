//! A thread that works on the newest question only.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use sindyscope_core::study::Cancel;

/// How long a run may take before a newer question stops it. A shorter run is left to end, so that while a slider is
/// dragged the window keeps showing new answers instead of none.
const PATIENCE: Duration = Duration::from_millis(400);

/// A thread with an inbox of one place: a question that arrives while another waits replaces it.
pub(crate) struct Worker<Q, A> {
    inbox: Arc<Inbox<Q>>,
    answers: Receiver<A>,
}

struct Inbox<Q> {
    slot: Mutex<Slot<Q>>,
    bell: Condvar,
}

struct Slot<Q> {
    waiting: Option<Q>,
    running: Option<Run>,
    closed: bool,
}

#[derive(Clone)]
struct Run {
    cancel: Cancel,
    since: Instant,
    progress: Option<f64>,
}

impl<Q> Inbox<Q> {
    fn lock(&self) -> MutexGuard<'_, Slot<Q>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a question; none once the window is gone.
    fn take(&self) -> Option<(Q, Cancel)> {
        let mut slot = self.lock();
        loop {
            if slot.closed {
                return None;
            }
            if let Some(question) = slot.waiting.take() {
                let cancel = Cancel::default();
                slot.running = Some(Run { cancel: cancel.clone(), since: Instant::now(), progress: None });
                return Some((question, cancel));
            }
            slot = self.bell.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// How far a run has come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Busy {
    /// For how long it has been running.
    pub(crate) elapsed: Duration,
    /// Share done, 0 to 1, if the work tells.
    pub(crate) progress: Option<f64>,
}

impl<Q: Send + 'static, A: Send + 'static> Worker<Q, A> {
    /// Starts a thread of this name. `work` answers a question, or nothing if it was cancelled; it may tell the share done.
    /// `wake` is called after each answer and each bit of progress. If `work` panics, `crashed` answers in its place.
    pub(crate) fn spawn(
        name: &str,
        wake: impl Fn() + Send + 'static,
        mut work: impl FnMut(Q, &Cancel, &(dyn Fn(f64) + Sync)) -> Option<A> + Send + 'static,
        crashed: impl Fn() -> A + Send + 'static,
    ) -> std::io::Result<Self> {
        let inbox = Arc::new(Inbox {
            slot: Mutex::new(Slot { waiting: None, running: None, closed: false }),
            bell: Condvar::new(),
        });
        let (send, answers) = channel();
        let mine = Arc::clone(&inbox);
        thread::Builder::new().name(name.to_owned()).spawn(move || {
            while let Some((question, cancel)) = mine.take() {
                let tell = |share: f64| {
                    if let Some(run) = &mut mine.lock().running {
                        run.progress = Some(share);
                    }
                };
                let answer = catch_unwind(AssertUnwindSafe(|| work(question, &cancel, &tell)));
                let answer = answer.unwrap_or_else(|_| Some(crashed()));
                let gone = answer.is_some_and(|answer| send.send(answer).is_err());
                mine.lock().running = None;
                if gone {
                    return;
                }
                wake();
            }
        })?;
        Ok(Self { inbox, answers })
    }

    /// Asks; the newest question wins over one that waits, and over one that has been running for long.
    pub(crate) fn ask(&self, question: Q) {
        let mut slot = self.inbox.lock();
        slot.waiting = Some(question);
        if let Some(run) = &slot.running
            && run.since.elapsed() > PATIENCE
        {
            run.cancel.cancel();
        }
        self.inbox.bell.notify_one();
    }

    /// Asks, and stops whatever runs.
    pub(crate) fn ask_instead(&self, question: Q) {
        self.cancel();
        self.ask(question);
    }

    /// Stops what runs and forgets what waits.
    pub(crate) fn cancel(&self) {
        let mut slot = self.inbox.lock();
        slot.waiting = None;
        if let Some(run) = &slot.running {
            run.cancel.cancel();
        }
    }

    /// The next answer, if there is one.
    pub(crate) fn answer(&self) -> Option<A> {
        self.answers.try_recv().ok()
    }

    /// What runs, or waits to.
    pub(crate) fn busy(&self) -> Option<Busy> {
        let slot = self.inbox.lock();
        match (&slot.running, &slot.waiting) {
            (Some(run), _) => Some(Busy { elapsed: run.since.elapsed(), progress: run.progress }),
            (None, Some(_)) => Some(Busy { elapsed: Duration::ZERO, progress: None }),
            (None, None) => None,
        }
    }
}

impl<Q, A> Drop for Worker<Q, A> {
    fn drop(&mut self) {
        let mut slot = self.inbox.lock();
        slot.closed = true;
        slot.waiting = None;
        if let Some(run) = &slot.running {
            run.cancel.cancel();
        }
        self.inbox.bell.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(pace: Duration) -> Worker<u64, Option<u64>> {
        Worker::spawn(
            "squares",
            || {},
            move |n, cancel, tell| {
                let until = Instant::now() + pace;
                while Instant::now() < until {
                    if cancel.is_cancelled() {
                        return None;
                    }
                    tell(0.5);
                    thread::sleep(Duration::from_millis(1));
                }
                assert!(n != 13, "unlucky");
                Some(Some(n * n))
            },
            || None,
        )
        .unwrap()
    }

    fn wait<A>(mut poll: impl FnMut() -> Option<A>) -> A {
        let until = Instant::now() + Duration::from_secs(20);
        loop {
            if let Some(found) = poll() {
                return found;
            }
            assert!(Instant::now() < until, "nothing came");
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_short_run_ends_and_the_newest_question_follows() {
        let worker = squares(Duration::from_millis(60));
        worker.ask(2);
        wait(|| worker.busy()?.progress);
        for n in 3..=9 {
            worker.ask(n);
        }
        assert_eq!(wait(|| worker.answer()), Some(4));
        assert_eq!(wait(|| worker.answer()), Some(81));
        assert!(wait(|| Some(worker.busy().is_none())));
        assert_eq!(worker.answer(), None, "what was replaced is never answered");
    }

    #[test]
    fn a_long_run_gives_way() {
        let worker = squares(Duration::from_secs(3600));
        worker.ask(2);
        wait(|| worker.busy()?.progress);
        let started = Instant::now();
        worker.cancel();
        wait(|| worker.busy().is_none().then_some(()));
        assert!(started.elapsed() < Duration::from_secs(10), "it stops at its next check");
        assert_eq!(worker.answer(), None);
    }

    #[test]
    fn a_crash_is_an_answer_and_the_thread_lives_on() {
        let worker = squares(Duration::ZERO);
        worker.ask(13);
        assert_eq!(wait(|| worker.answer()), None);
        worker.ask(3);
        assert_eq!(wait(|| worker.answer()), Some(9));
    }
}
