//! State, what was computed from it, and the queue that computes: the program without its window.

use std::path::PathBuf;

use super::derived::Derived;
use super::jobs::{Done, Job, JobUpdate, Jobs, Key};
use super::log::Log;
use super::message::Message;
use super::saving::SaveResult;
use super::state::State;
use super::update::{self, FrameTime, Want};

/// The program, as a window shows it and as a log is replayed by it.
pub(crate) struct WindowProgram {
    pub(crate) state: State,
    pub(crate) derived: Derived,
    pub(crate) jobs: Jobs,
    pub(crate) log: Log,
    /// True once a session has come back, until that was taken in.
    pub(crate) restored: bool,
}

impl WindowProgram {
    /// A program that begins with this state; `wake` is called whenever there is something to take in.
    pub(crate) fn new(state: State, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let derived = Derived::new(&state.document.edit);
        let mut program = Self { log: Log::new(&state), state, derived, jobs: Jobs::new(wake), restored: false };
        program.begin();
        program
    }

    /// Has the session that lies there brought back, or files opened in it.
    pub(crate) fn restore(&mut self, session: PathBuf, files: Vec<PathBuf>) {
        self.jobs.want(Key::Restore, Job::Restore { session, files });
        self.derived.running = self.jobs.running();
    }

    /// Goes on from the state that a session left.
    fn restart(&mut self, state: State, problem: Option<String>) {
        (self.log, self.derived) = (Log::new(&state), Derived::new(&state.document.edit));
        (self.state, self.restored) = (state, true);
        if let Some(problem) = problem {
            self.derived.notices.error(problem);
        }
        self.begin();
    }

    fn begin(&mut self) {
        let wants = update::begin(&mut self.state, &mut self.derived);
        self.ask(wants);
    }

    /// Takes a message over.
    pub(crate) fn send(&mut self, message: Message) {
        self.log.note(&message);
        let wants = update::update(&mut self.state, &mut self.derived, message);
        self.ask(wants);
    }

    /// Takes in what the background work brought, and asks for what is in view and not there. Gives back what was not saved
    /// because there is a file already.
    pub(crate) fn advance(&mut self, clock: FrameTime) -> Vec<SaveResult> {
        let mut taken = Vec::new();
        for (key, update) in self.jobs.poll() {
            let (state, derived) = (&mut self.state, &mut self.derived);
            let wants = match update {
                JobUpdate::Part(part) => update::part(state, derived, part, clock),
                JobUpdate::Done(Done::Saved(SaveResult::Taken { purpose, path })) => {
                    taken.push(SaveResult::Taken { purpose, path });
                    continue;
                }
                JobUpdate::Done(Done::Restored(state, problem)) => {
                    self.restart(*state, problem);
                    continue;
                }
                JobUpdate::Done(done) => {
                    let saved = done.saved_project();
                    let wants = update::finished(state, derived, done, clock);
                    if let Some(path) = saved {
                        self.send(Message::ProjectSaved(path));
                    }
                    wants
                }
                JobUpdate::Failed(reason) => update::failed(state, derived, &key, reason),
            };
            self.ask(wants);
        }
        self.derived.running = self.jobs.running();
        self.derived.running.remove(&Key::Session);
        if let Some(progress) = self.derived.progress(&Key::Search) {
            self.derived.missing.progress(progress);
        }
        self.derived.rig.class.progress = self.derived.progress(&Key::SearchRound).and_then(|p| p.share);
        if let Some(note) = self.derived.missing.note() {
            self.derived.notices.note(note);
        }
        self.demand(clock.held);
        taken
    }

    /// Asks for what is in view and not there.
    pub(crate) fn demand(&mut self, held: bool) {
        let wants = update::demand(&mut self.state, &mut self.derived, held);
        self.ask(wants);
    }

    /// Asks for a job that concerns the state in nothing: writing a file.
    pub(crate) fn want(&self, key: Key, job: Job) {
        self.jobs.want(key, job);
    }

    /// True while something is computed, or was and is not taken in yet.
    pub(crate) fn busy(&self) -> bool {
        self.jobs.busy() && !self.only_streams()
    }

    /// True while nothing but a stream is followed, which is done for as long as the stream lasts.
    fn only_streams(&self) -> bool {
        let running = self.jobs.running();
        running.contains_key(&Key::Stream) && running.len() == 1
    }

    fn ask(&self, wants: Vec<Want>) {
        for want in wants {
            match want {
                Want::Job(key, job) => self.jobs.want(key, job),
                Want::Instead(key, job) => self.jobs.want_instead(key, job),
                Want::Cancel(key) => self.jobs.cancel(&key),
            }
        }
    }
}
