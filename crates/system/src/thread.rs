//! Threads.

use std::io;

/// Starts a thread. In a browser only the page's own thread can; where the browser gives the page no workers, the task is done there, a little
/// later.
///
/// # Errors
/// The system gives no thread more.
pub fn spawn(name: String, task: impl FnOnce() + Send + 'static) -> io::Result<()> {
    #[cfg(target_arch = "wasm32")]
    return super::browser::workers::spawn(&name, task);
    #[cfg(not(target_arch = "wasm32"))]
    std::thread::Builder::new().name(name).spawn(task).map(drop)
}

/// How a thread tells the window that there is something to see: `wake` itself, or in a browser what has the page call it soon, since
/// there no other thread may touch what the page draws.
pub fn waker(wake: impl Fn() + Send + Sync + 'static) -> impl Fn() + Send + Sync + 'static {
    #[cfg(target_arch = "wasm32")]
    return super::browser::waker(wake);
    #[cfg(not(target_arch = "wasm32"))]
    wake
}

/// True on a thread that must not wait for another: a browser's page.
pub fn must_not_wait() -> bool {
    #[cfg(target_arch = "wasm32")]
    return super::browser::on_page();
    #[cfg(not(target_arch = "wasm32"))]
    false
}
