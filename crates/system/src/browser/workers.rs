//! Threads: workers of the browser on the page's memory.

use std::collections::BTreeMap;
use std::io;
use std::sync::mpsc::channel;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use rayon::{ThreadBuilder, ThreadPoolBuilder};

use super::{has_workers, on_page};
use crate::lock;

type Task = Box<dyn FnOnce() + Send>;

/// Tasks that are handed to workers, by their numbers, and the number of the next.
static TASKS: Mutex<(BTreeMap<u32, Task>, u32)> = Mutex::new((BTreeMap::new(), 0));

/// Whether the workers that share the numerics stand by.
static SHARED: (Mutex<bool>, Condvar) = (Mutex::new(false), Condvar::new());

/// Workers that share the numerics at most: each takes some megabytes.
const MOST: usize = 8;

/// Starts a thread, for whatever comes once the numerics can be shared.
pub(crate) fn spawn(name: &str, task: impl FnOnce() + Send + 'static) -> io::Result<()> {
    if !has_workers() {
        return start(name, task);
    }
    start(name, move || {
        let (ready, bell) = &SHARED;
        let mut ready = ready.lock().unwrap_or_else(PoisonError::into_inner);
        while !*ready {
            ready = bell.wait(ready).unwrap_or_else(PoisonError::into_inner);
        }
        drop(ready);
        task();
    })
}

fn start(name: &str, task: impl FnOnce() + Send + 'static) -> io::Result<()> {
    if !on_page() {
        return Err(io::Error::new(io::ErrorKind::Unsupported, "only the page itself starts workers"));
    }
    let mut tasks = lock(&TASKS);
    let number = tasks.1;
    tasks.0.insert(number, Box::new(task));
    tasks.1 += 1;
    drop(tasks);
    if !has_workers() {
        super::later(number);
        return Ok(());
    }
    super::spawn(&wasm_bindgen::module(), &wasm_bindgen::memory(), number, name);
    Ok(())
}

/// Does what was handed in under this number.
pub(super) fn run(number: u32) {
    let task = lock(&TASKS).0.remove(&number);
    if let Some(task) = task {
        task();
    }
}

/// Starts the workers that share the numerics: as many as there are cores but the page's.
pub(super) fn share_numerics() {
    if !has_workers() {
        // It fails only where one stands already.
        let _ = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
        return;
    }
    // The standard library knows no number of cores here.
    let cores = js_sys::Reflect::get(&js_sys::global(), &"navigator".into())
        .and_then(|navigator| js_sys::Reflect::get(&navigator, &"hardwareConcurrency".into()))
        .ok()
        .and_then(|cores| cores.as_f64())
        .map_or(1, |cores| cores as usize);
    let workers = cores.saturating_sub(1).clamp(1, MOST);
    let (hand_out, builders) = channel::<ThreadBuilder>();
    let builders = Arc::new(Mutex::new(builders));
    for worker in 0..workers {
        let builders = Arc::clone(&builders);
        // Workers wait here; they hold the lock until one builder came, and then the next waits.
        let serve = move || {
            let builder = builders.lock().unwrap_or_else(PoisonError::into_inner).recv();
            if let Ok(builder) = builder {
                builder.run();
            }
        };
        // A page always starts workers.
        let _ = start(&format!("numerics {}", worker + 1), serve);
    }
    let _ = start("numerics", move || {
        let hand_out = move |builder| hand_out.send(builder).map_err(|_| io::ErrorKind::BrokenPipe.into());
        // It waits for them all: not for the page's own thread. It fails only where one stands already.
        let _ = ThreadPoolBuilder::new().num_threads(workers).spawn_handler(hand_out).build_global();
        *SHARED.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
        SHARED.1.notify_all();
    });
}
