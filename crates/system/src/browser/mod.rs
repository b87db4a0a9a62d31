//! What a browser gives: a page that draws, workers on its memory, and a store for what is kept.
//!
//! The page's part is JavaScript, in `crates/web/page`: an object `sindyscopeHost` on the page and in every worker.

pub mod files;
pub(crate) mod workers;

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::{JsCast as _, JsValue, wasm_bindgen};

use crate::lock;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn complain(text: &str);
}

#[wasm_bindgen(js_namespace = sindyscopeHost)]
extern "C" {
    /// Has the page call `page_woken` soon.
    #[wasm_bindgen(js_name = wake)]
    fn ask_page();
    /// Starts a worker on this memory that calls `run_task` with the number.
    fn spawn(module: &JsValue, memory: &JsValue, task: u32, name: &str);
    /// Has the page call `run_task` with the number soon.
    fn later(task: u32);
    /// True if the browser lets workers share this memory.
    fn shares() -> bool;
    /// Keeps a file beyond the page's life, or no longer if there are no bytes.
    fn keep(path: &str, bytes: Option<Uint8Array>);
    /// Hands a file to the person.
    fn give(name: &str, bytes: Uint8Array);
    /// Says that the window has stopped, and why.
    fn stopped(text: &str);
    /// Asks for files: pairs of a name and bytes; nothing if none was chosen.
    #[wasm_bindgen(catch)]
    async fn pick(endings: &str, several: bool) -> Result<JsValue, JsValue>;
}

thread_local! {
    static ON_PAGE: Cell<bool> = const { Cell::new(false) };
    static WAKE: RefCell<Option<Box<dyn Fn()>>> = const { RefCell::new(None) };
    static UNKEPT: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// What a worker that panicked said.
static CRASHED: Mutex<Option<String>> = Mutex::new(None);

/// True if workers can share this memory.
static SHARES: AtomicBool = AtomicBool::new(false);

/// True between a wish to wake the page and its waking.
static ASKED: AtomicBool = AtomicBool::new(false);

/// True on the page's own thread.
pub fn on_page() -> bool {
    ON_PAGE.get()
}

/// True if there are workers to compute: else the page stands still while it does.
pub fn has_workers() -> bool {
    SHARES.load(Ordering::Relaxed)
}

/// Takes this thread for the page's, with the files that were kept (pairs of a path and bytes), and starts the workers that share
/// the numerics. To be called first, and once.
pub fn begin(kept: &Array) {
    ON_PAGE.set(true);
    SHARES.store(shares(), Ordering::Relaxed);
    files::restore(kept.iter().filter_map(named_bytes));
    workers::share_numerics();
}

/// A pair of a name and bytes.
fn named_bytes(pair: JsValue) -> Option<(String, Vec<u8>)> {
    let pair = pair.dyn_into::<Array>().ok()?;
    Some((pair.get(0).as_string()?, pair.get(1).dyn_into::<Uint8Array>().ok()?.to_vec()))
}

/// Asks a person for files; their paths, or nothing if none was chosen. `endings` as a browser lists them: `.csv,.mat`.
pub async fn ask(endings: String, several: bool) -> Option<Vec<PathBuf>> {
    let chosen = pick(&endings, several).await.ok()?.dyn_into::<Array>().ok()?;
    Some(files::place(chosen.iter().filter_map(named_bytes).collect())).filter(|paths| !paths.is_empty())
}

/// Why the browser does not keep the work, if it has just refused to.
pub fn unkept() -> Option<String> {
    UNKEPT.take()
}

/// Why a computation ended that should not have, if one has just done so.
pub fn crashed() -> Option<String> {
    lock(&CRASHED).take()
}

/// Has panics told: of the page by what stands in place of the window, of a worker through [`crashed`]. To be called once the
/// window's frame has set its own telling up, which takes any panic for the page's.
pub fn tell_panics() {
    let of_page = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let text = panic.to_string();
        if on_page() {
            of_page(panic);
            stopped(&text);
        } else {
            complain(&text);
            *lock(&CRASHED) = Some(text);
            ask_to_wake();
        }
    }));
}

pub(crate) fn waker(wake: impl Fn() + 'static) -> impl Fn() + Send + Sync + 'static {
    WAKE.set(Some(Box::new(wake)));
    ask_to_wake
}

/// Has the page woken soon, from whatever thread.
pub(crate) fn ask_to_wake() {
    if !ASKED.swap(true, Ordering::AcqRel) {
        ask_page();
    }
}

/// What the page does once it is woken.
#[doc(hidden)]
#[wasm_bindgen]
pub fn page_woken() {
    ASKED.store(false, Ordering::Release);
    for change in files::changes() {
        match change {
            files::FileChange::Kept(path, bytes) => {
                keep(&path.to_string_lossy(), bytes.map(|bytes| Uint8Array::from(bytes.as_slice())));
            }
            files::FileChange::Given(name, bytes) => give(&name, Uint8Array::from(bytes.as_slice())),
        }
    }
    WAKE.with_borrow(|wake| wake.iter().for_each(|wake| wake()));
}

/// Tells that the browser does not keep the work, and why.
#[doc(hidden)]
#[wasm_bindgen]
pub fn page_keeps_not(reason: String) {
    UNKEPT.set(Some(reason));
    ask_to_wake();
}

/// What a worker does, or the page itself where there is none: a task that was handed in by the page.
#[doc(hidden)]
#[wasm_bindgen]
pub fn run_task(number: u32) {
    workers::run(number);
}
