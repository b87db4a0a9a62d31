//! Work on a thread of its own, while the interpreter runs on: it hears of Ctrl+C and of progress.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{error, failed};
use sindyscope_analysis::{AnalysisError, AnalysisProgress};
use sindyscope_core::study::Cancel;

/// How often the interpreter is asked for Ctrl+C; a fifth of what a person notices.
const POLL: Duration = Duration::from_millis(20);
/// Stack of a thread that works: as that of a program's main thread, on which the commands run.
const STACK: usize = 8 << 20;

static AT_WORK: AtomicUsize = AtomicUsize::new(0);

/// The threads of this process: those of a process that was forked are not there in its child.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Analyses at work in this process.
pub(crate) fn at_work() -> usize {
    AT_WORK.load(Ordering::Acquire)
}

/// Counts an analysis as long as it lives.
struct AtWork;

impl AtWork {
    fn begin() -> Self {
        AT_WORK.fetch_add(1, Ordering::AcqRel);
        Self
    }
}

impl Drop for AtWork {
    fn drop(&mut self) {
        AT_WORK.fetch_sub(1, Ordering::AcqRel);
    }
}

fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((of, threads)) = pool.as_ref()
        && *of == process
    {
        return Ok(Arc::clone(threads));
    }
    let made = ThreadPoolBuilder::new().stack_size(STACK).build();
    let made = Arc::new(made.map_err(|e| error(format!("no threads to work on: {e}"), String::new()))?);
    // Threads of a parent process would be waited for in vain.
    std::mem::forget(pool.replace((process, Arc::clone(&made))));
    Ok(made)
}

enum WorkEvent<T> {
    Progress(AnalysisProgress),
    Done(Result<T, AnalysisError>),
}

/// Does work without the interpreter's lock. A callback is told `(what, share)` on the caller's thread, the share none where it is
/// not known; Ctrl+C or an exception of the callback ends the wait at once, and the work at its next look at the flag.
pub(crate) fn done<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Cancel, &(dyn Fn(AnalysisProgress) + Sync)) -> Result<T, AnalysisError> + Send + 'static,
) -> PyResult<T> {
    let cancel = Cancel::default();
    let (sender, mut events) = mpsc::channel();
    let (flag, pool, wanted) = (cancel.clone(), pool()?, progress.is_some());
    let here = AtWork::begin();
    pool.spawn(move || {
        let tell = |progress: AnalysisProgress| {
            if wanted {
                // Nobody listens any more once the caller was interrupted.
                let _ = sender.send(WorkEvent::Progress(progress));
            }
        };
        let result = work(&flag, &tell);
        drop(here);
        let _ = sender.send(WorkEvent::Done(result));
    });
    let given_up = |e: PyErr| {
        cancel.cancel();
        Err(e)
    };
    loop {
        let (back, event) = py.detach(move || next(events));
        events = back;
        match event {
            Ok(WorkEvent::Done(result)) => return result.map_err(|e| failed(&e)),
            Ok(WorkEvent::Progress(told)) => {
                let (what, share) = match told {
                    AnalysisProgress::Stage(what) => (what, None),
                    AnalysisProgress::Share(what, share) => (what, Some(share)),
                };
                if let Some(Err(e)) = progress.as_ref().map(|f| f.call1(py, (what, share))) {
                    return given_up(e);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the analysis broke off: please report it with the records"));
            }
        }
        if let Err(e) = py.check_signals() {
            return given_up(e);
        }
    }
}

/// What comes next, with the receiver, which one thread has at a time.
fn next<T>(events: Receiver<WorkEvent<T>>) -> (Receiver<WorkEvent<T>>, Result<WorkEvent<T>, RecvTimeoutError>) {
    let event = events.recv_timeout(POLL);
    (events, event)
}
