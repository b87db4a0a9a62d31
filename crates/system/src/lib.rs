//! Files, threads and the clock: the system's own, or what a browser gives instead.
//!
//! Whoever reads a file, starts a thread or asks for the time through this crate does so in a browser too. There, files lie in
//! memory and the page keeps those below `/kept`; any other file that is written is handed to the person as a download. A thread is a
//! worker on the memory of all. The page's own thread must never sleep: whatever it shares with others it locks by [`lock`].
//!
//! ```
//! use sindyscope_system::{fs, lock, time::Instant};
//!
//! let (began, shared) = (Instant::now(), std::sync::Mutex::new(0));
//! *lock(&shared) += 1;
//! assert!(fs::read("no such file").is_err() && began.elapsed().as_secs() < 60);
//! ```

#[cfg(target_arch = "wasm32")]
pub mod browser;
pub mod fs;
pub mod thread;

/// The clock.
pub mod time {
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::time::{Instant, SystemTime, UNIX_EPOCH};
    #[cfg(target_arch = "wasm32")]
    pub use web_time::{Instant, SystemTime, UNIX_EPOCH};
}

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks what is held for moments only. What a thread that panicked left is taken as it is.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    #[cfg(target_arch = "wasm32")]
    if browser::on_page() {
        use std::sync::TryLockError;
        // A page that sleeps is killed by the browser.
        loop {
            match mutex.try_lock() {
                Ok(guard) => return guard,
                Err(TryLockError::Poisoned(poisoned)) => return poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => std::hint::spin_loop(),
            }
        }
    }
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
