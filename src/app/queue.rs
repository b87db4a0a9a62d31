//! The queue of background work: a job is wanted under a key, and the newest job of a key wins.
//!
//! Jobs of different keys run beside each other, each on a thread of its own; threads that have nothing to do are used again.
//! What the jobs of one key may use again lies in a memory that is handed from each to the next.

use std::collections::{HashMap, VecDeque};
use std::fmt::Debug;
use std::hash::Hash;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use sindyscope_core::study::Cancel;
use sindyscope_system::thread::must_not_wait;
use sindyscope_system::time::Instant;
use sindyscope_system::{lock, thread};

/// How long a run may take before a newer job of its key stops it. A shorter run is left to end, so that while a slider is
/// dragged the window keeps showing new results instead of none.
const PATIENCE: Duration = Duration::from_millis(400);

/// What is told of a job that panicked.
const CRASHED: &str = "that failed by an error of the program itself; please report what you did";

/// A closed set of jobs.
pub(crate) trait Work: Send + Sized + 'static {
    /// What jobs replace each other by.
    type Key: Clone + Debug + Eq + Hash + Send;
    /// What is told on the way.
    type Part: Send;
    /// What came of a job.
    type Done: Send;
    /// What the next job of the same key may use again.
    type Memory: Default + Send;

    /// Does the job, or says in a sentence why not. Whatever it gives after it was cancelled is dropped.
    fn run(self, memory: &mut Self::Memory, report: &JobReport<'_, Self>) -> Result<Self::Done, String>;
}

/// What has come of a job since it was asked for last.
#[derive(Debug, PartialEq)]
pub(crate) enum JobUpdate<P, D> {
    /// Something on the way; more comes.
    Part(P),
    /// It has ended.
    Done(D),
    /// It has ended without a result, for this reason.
    Failed(String),
}

/// How far a job has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JobProgress {
    /// For how long it has been running.
    pub(crate) elapsed: Duration,
    /// Share done, 0 to 1, if the job tells.
    pub(crate) share: Option<f64>,
    /// What it does at the moment, if the job tells.
    pub(crate) stage: Option<&'static str>,
}

/// How much of a job must be done, and for how long it must have run, before it is said how long it will still take.
const TELLING: (f64, Duration) = (0.02, Duration::from_secs(2));

impl JobProgress {
    /// How far it has come, and how long it will take if it goes on like this, as far as that can be told: `40 %, 6 s left`.
    pub(crate) fn words(&self) -> String {
        let Some(share) = self.share else { return String::new() };
        let percent = format!("{:.0} %", 100.0 * share);
        if share < TELLING.0 || share >= 1.0 || self.elapsed < TELLING.1 {
            return percent;
        }
        let left = self.elapsed.mul_f64((1.0 - share) / share).as_secs_f64();
        match left {
            left if left < 100.0 => format!("{percent}, {left:.0} s left"),
            left => format!("{percent}, {:.0} min left", left / 60.0),
        }
    }
}

/// What a running job sees of the queue.
pub(crate) struct JobReport<'a, W: Work> {
    /// Set as soon as nobody wants the result any more.
    pub(crate) cancel: &'a Cancel,
    key: &'a W::Key,
    shared: &'a Shared<W>,
}

impl<W: Work> JobReport<'_, W> {
    /// Tells the share that is done, 0 to 1.
    pub(crate) fn share(&self, share: f64) {
        self.progress(|run| run.share = Some(share));
    }

    /// Tells what is being done, and the share of the whole that is done.
    pub(crate) fn stage(&self, stage: &'static str, share: f64) {
        self.progress(|run| (run.stage, run.share) = (Some(stage), Some(share)));
    }

    fn progress(&self, change: impl FnOnce(&mut RunningJob)) {
        if let Some(run) = self.shared.lock().slots.get_mut(self.key).and_then(|slot| slot.running.as_mut()) {
            change(run);
        }
        (self.shared.wake)();
    }

    /// Hands over what was found so far.
    pub(crate) fn part(&self, part: W::Part) {
        self.shared.lock().tell(self.key, self.cancel, JobUpdate::Part(part));
        (self.shared.wake)();
    }
}

/// What came of a job, with the key that it was wanted by.
type KeyedUpdate<W> = (<W as Work>::Key, JobUpdate<<W as Work>::Part, <W as Work>::Done>);

/// The queue, as the window holds it.
pub(crate) struct Queue<W: Work> {
    shared: Arc<Shared<W>>,
    updates: Receiver<Told<W>>,
}

/// An update of a job, with the flag that tells whether it is still wanted.
type Told<W> = (<W as Work>::Key, Cancel, JobUpdate<<W as Work>::Part, <W as Work>::Done>);

struct Shared<W: Work> {
    state: Mutex<QueueState<W>>,
    bell: Condvar,
    wake: Box<dyn Fn() + Send + Sync>,
}

struct QueueState<W: Work> {
    slots: HashMap<W::Key, Slot<W>>,
    /// Keys whose job may begin.
    ready: VecDeque<W::Key>,
    send: Sender<Told<W>>,
    /// Updates that were sent and not taken in yet.
    undelivered: usize,
    threads: usize,
    idle: usize,
    closed: bool,
}

struct Slot<W: Work> {
    waiting: Option<W>,
    running: Option<RunningJob>,
    /// The flag of the run that is under way or was the last: its updates are dropped once it is set.
    last: Cancel,
    /// Results that were told and not taken in yet.
    untaken: usize,
    memory: W::Memory,
}

#[derive(Clone)]
struct RunningJob {
    cancel: Cancel,
    since: Instant,
    share: Option<f64>,
    stage: Option<&'static str>,
}

impl<W: Work> Default for Slot<W> {
    fn default() -> Self {
        Self { waiting: None, running: None, last: Cancel::default(), untaken: 0, memory: W::Memory::default() }
    }
}

impl<W: Work> Slot<W> {
    fn progress(&self) -> Option<JobProgress> {
        let untaken = self.untaken > 0 && !self.last.is_cancelled();
        match self.running.as_ref().filter(|run| !run.cancel.is_cancelled()) {
            Some(run) => Some(JobProgress { elapsed: run.since.elapsed(), share: run.share, stage: run.stage }),
            None => (self.waiting.is_some() || untaken).then(JobProgress::default),
        }
    }
}

impl<W: Work> QueueState<W> {
    fn tell(&mut self, key: &W::Key, cancel: &Cancel, update: JobUpdate<W::Part, W::Done>) {
        if let (Some(slot), false) = (self.slots.get_mut(key), matches!(update, JobUpdate::Part(_))) {
            slot.untaken += 1;
        }
        // Without a receiver the window is gone.
        if self.send.send((key.clone(), cancel.clone(), update)).is_ok() {
            self.undelivered += 1;
        }
    }
}

impl<W: Work> Shared<W> {
    fn lock(&self) -> MutexGuard<'_, QueueState<W>> {
        lock(&self.state)
    }

    /// Waits for a job that may begin; none once the window is gone, or where there is no job and a thread must not wait.
    fn take(&self) -> Option<(W::Key, W, W::Memory, Cancel)> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            if let Some(key) = state.ready.pop_front() {
                let Some(slot) = state.slots.get_mut(&key) else { continue };
                let Some(job) = slot.waiting.take() else { continue };
                let cancel = Cancel::default();
                slot.running =
                    Some(RunningJob { cancel: cancel.clone(), since: Instant::now(), share: None, stage: None });
                slot.last = cancel.clone();
                let memory = std::mem::take(&mut slot.memory);
                return Some((key, job, memory, cancel));
            }
            // The next job that is wanted comes back here.
            if must_not_wait() {
                return None;
            }
            state.idle += 1;
            state = self.bell.wait(state).unwrap_or_else(PoisonError::into_inner);
            state.idle -= 1;
        }
    }

    /// Does jobs until the window is gone.
    fn serve(&self) {
        while let Some((key, job, mut memory, cancel)) = self.take() {
            let report = JobReport { cancel: &cancel, key: &key, shared: self };
            let result = catch_unwind(AssertUnwindSafe(|| job.run(&mut memory, &report)));
            let update = match result {
                Ok(Ok(done)) => JobUpdate::Done(done),
                Ok(Err(reason)) => JobUpdate::Failed(reason),
                Err(_) => {
                    // What a panic left behind may be half changed.
                    memory = W::Memory::default();
                    JobUpdate::Failed(CRASHED.to_owned())
                }
            };
            let mut state = self.lock();
            state.tell(&key, &cancel, update);
            if let Some(slot) = state.slots.get_mut(&key) {
                (slot.running, slot.memory) = (None, memory);
                if slot.waiting.is_some() {
                    state.ready.push_back(key);
                }
            }
            drop(state);
            (self.wake)();
        }
    }
}

impl<W: Work> Queue<W> {
    /// An empty queue; `wake` is called whenever there is something to see.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        let (send, updates) = channel();
        let state = QueueState {
            slots: HashMap::new(),
            ready: VecDeque::new(),
            send,
            undelivered: 0,
            threads: 0,
            idle: 0,
            closed: false,
        };
        let shared = Shared { state: Mutex::new(state), bell: Condvar::new(), wake: Box::new(wake) };
        Self { shared: Arc::new(shared), updates }
    }

    /// Asks for a job. It replaces one of its key that waits, and one that has been running for long; a short run is let end.
    pub(crate) fn want(&self, key: W::Key, job: W) {
        let mut state = self.shared.lock();
        let slot = state.slots.entry(key.clone()).or_default();
        let waited = slot.waiting.replace(job).is_some();
        match &slot.running {
            Some(run) if run.since.elapsed() > PATIENCE => return run.cancel.cancel(),
            Some(_) => return,
            None if waited => return,
            None => state.ready.push_back(key),
        }
        if state.idle < state.ready.len() {
            self.hire(state);
        } else {
            self.shared.bell.notify_one();
        }
    }

    /// Asks for a job, and stops whatever runs under its key.
    pub(crate) fn want_instead(&self, key: W::Key, job: W) {
        self.cancel(&key);
        self.want(key, job);
    }

    /// Starts one thread more.
    fn hire(&self, mut state: MutexGuard<'_, QueueState<W>>) {
        let shared = Arc::clone(&self.shared);
        let name = format!("job {}", state.threads + 1);
        match thread::spawn(name, move || shared.serve()) {
            Ok(()) => state.threads += 1,
            // Those that there are take it in time.
            Err(_) if state.threads > 0 => {}
            Err(error) => {
                for key in std::mem::take(&mut state.ready) {
                    let reason = format!("the system gives no thread for the computation ({error})");
                    if let Some(slot) = state.slots.get_mut(&key) {
                        (slot.waiting, slot.last) = (None, Cancel::default());
                        let flag = slot.last.clone();
                        state.tell(&key, &flag, JobUpdate::Failed(reason));
                    }
                }
            }
        }
    }

    /// Stops what runs under a key, and forgets what waits and what it told.
    pub(crate) fn cancel(&self, key: &W::Key) {
        let mut state = self.shared.lock();
        if let Some(slot) = state.slots.get_mut(key) {
            slot.last.cancel();
            if slot.waiting.take().is_some() {
                state.ready.retain(|other| other != key);
            }
        }
    }

    /// What has come since the last call, in order. Of jobs that were cancelled nothing comes.
    pub(crate) fn poll(&self) -> Vec<KeyedUpdate<W>> {
        let told: Vec<Told<W>> = self.updates.try_iter().collect();
        let mut state = self.shared.lock();
        state.undelivered -= told.len();
        for (key, _, update) in &told {
            if let (Some(slot), false) = (state.slots.get_mut(key), matches!(update, JobUpdate::Part(_))) {
                slot.untaken -= 1;
            }
        }
        drop(state);
        told.into_iter().filter(|(_, cancel, _)| !cancel.is_cancelled()).map(|(key, _, update)| (key, update)).collect()
    }

    /// How far each job has come that is wanted and whose result was not taken in yet.
    pub(crate) fn running(&self) -> HashMap<W::Key, JobProgress> {
        let state = self.shared.lock();
        state.slots.iter().filter_map(|(key, slot)| Some((key.clone(), slot.progress()?))).collect()
    }

    /// True while a job runs or waits, and until all that was told is taken in.
    pub(crate) fn busy(&self) -> bool {
        let state = self.shared.lock();
        state.undelivered > 0 || state.slots.values().any(|slot| slot.running.is_some() || slot.waiting.is_some())
    }

    /// Waits for the job of a key to end, but not for longer than this, and not at all where a thread must not wait.
    pub(crate) fn finish(&self, key: &W::Key, patience: Duration) {
        let until = Instant::now() + patience;
        let goes_on = || {
            let state = self.shared.lock();
            state.slots.get(key).is_some_and(|slot| slot.running.is_some() || slot.waiting.is_some())
        };
        while goes_on() && Instant::now() < until && !must_not_wait() {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl<W: Work> Drop for Queue<W> {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.closed = true;
        for slot in state.slots.values_mut() {
            slot.waiting = None;
            slot.last.cancel();
        }
        self.shared.bell.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    /// Squares a number, in so long a time; counts the squares of its key.
    struct Square(u64, Duration);

    impl Work for Square {
        type Key = &'static str;
        type Part = usize;
        type Done = u64;
        type Memory = usize;

        fn run(self, memory: &mut usize, report: &JobReport<'_, Self>) -> Result<u64, String> {
            let Self(number, pace) = self;
            let until = Instant::now() + pace;
            report.stage("squaring", 0.5);
            while Instant::now() < until && !report.cancel.is_cancelled() {
                thread::sleep(Duration::from_millis(1));
            }
            assert!(number != 13, "unlucky");
            *memory += 1;
            report.part(*memory);
            if number == 7 { Err("seven has none".to_owned()) } else { Ok(number * number) }
        }
    }

    const SOON: Duration = Duration::from_millis(60);
    const NEVER: Duration = Duration::from_secs(3600);

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

    /// What ends next, without the parts.
    fn next(jobs: &Queue<Square>) -> Result<u64, String> {
        wait(|| {
            jobs.poll().into_iter().find_map(|(_, update)| match update {
                JobUpdate::Part(_) => None,
                JobUpdate::Done(square) => Some(Ok(square)),
                JobUpdate::Failed(reason) => Some(Err(reason)),
            })
        })
    }

    fn started(jobs: &Queue<Square>, key: &'static str) {
        wait(|| jobs.running().get(&key)?.share);
    }

    #[test]
    fn a_short_run_ends_and_the_newest_job_of_its_key_follows() {
        let jobs = Queue::new(|| {});
        jobs.want("a", Square(2, SOON));
        started(&jobs, "a");
        for number in 3..=9 {
            jobs.want("a", Square(number, SOON));
        }
        assert_eq!(next(&jobs), Ok(4));
        assert_eq!(next(&jobs), Ok(81), "what was replaced is never answered");
        wait(|| (!jobs.busy()).then_some(()));
    }

    #[test]
    fn a_cancelled_run_stops_within_50_ms_and_nothing_of_it_is_told() {
        let jobs = Queue::new(|| {});
        let stopped = || {
            jobs.want("a", Square(2, NEVER));
            started(&jobs, "a");
            let asked = Instant::now();
            jobs.cancel(&"a");
            assert_eq!(jobs.running().get(&"a"), None, "at once for whoever looks");
            wait(|| {
                assert!(jobs.poll().is_empty());
                (!jobs.busy()).then_some(())
            });
            asked.elapsed()
        };
        // The machine may be busy with something else for once.
        let quickest = (0..10).map(|_| stopped()).min().unwrap();
        assert!(quickest < Duration::from_millis(50), "{quickest:?}");
        jobs.want_instead("a", Square(3, Duration::ZERO));
        assert_eq!(next(&jobs), Ok(9));
    }

    #[test]
    fn jobs_of_different_keys_do_not_wait_for_each_other() {
        let jobs = Queue::new(|| {});
        for key in ["a", "b", "c"] {
            jobs.want(key, Square(2, NEVER));
        }
        jobs.want("d", Square(5, Duration::ZERO));
        assert_eq!(next(&jobs), Ok(25));
    }

    #[test]
    fn a_panic_and_a_failure_are_told_and_the_key_lives_on() {
        let jobs = Queue::new(|| {});
        jobs.want("a", Square(13, Duration::ZERO));
        assert_eq!(next(&jobs), Err(CRASHED.to_owned()));
        jobs.want("a", Square(7, Duration::ZERO));
        assert_eq!(next(&jobs), Err("seven has none".to_owned()));
        jobs.want("a", Square(3, Duration::ZERO));
        assert_eq!(next(&jobs), Ok(9));
    }

    #[test]
    fn long_work_tells_how_far_it_is_and_how_long_it_will_take() {
        let words = |seconds: f64, share: Option<f64>| {
            JobProgress { elapsed: Duration::from_secs_f64(seconds), share, stage: None }.words()
        };
        assert_eq!(words(3.0, None), "");
        assert_eq!(words(1.0, Some(0.5)), "50 %");
        assert_eq!(words(4.0, Some(0.4)), "40 %, 6 s left");
        assert_eq!(words(60.0, Some(0.1)), "10 %, 9 min left");
    }

    #[test]
    fn the_jobs_of_a_key_share_a_memory() {
        let jobs = Queue::new(|| {});
        let mut counts = Vec::new();
        for key in ["a", "a", "b"] {
            jobs.want(key, Square(1, Duration::ZERO));
            wait(|| {
                let updates = jobs.poll();
                let ended = updates.iter().any(|(_, update)| matches!(update, JobUpdate::Done(_)));
                counts.extend(updates.into_iter().filter_map(|(_, update)| match update {
                    JobUpdate::Part(count) => Some(count),
                    _ => None,
                }));
                ended.then_some(())
            });
        }
        assert_eq!(counts, [1, 2, 1]);
    }
}
