//! Work on all cores where there are threads, else one piece after the other.
//!
//! With the feature `runtime` this is `rayon`. Without it the same calls return ordinary iterators, so that code which uses
//! them needs no second form.

#[cfg(feature = "runtime")]
pub use rayon::{join, prelude};
#[cfg(feature = "runtime")]
pub use sindyscope_system::lock;

/// Runs something on one of the threads that share work: what it then hands to others costs no change of threads each time.
#[cfg(feature = "runtime")]
pub fn within<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| work())
}

/// Runs something.
#[cfg(not(feature = "runtime"))]
pub fn within<R>(work: impl FnOnce() -> R) -> R {
    work()
}

/// Locks what nobody else can hold.
#[cfg(not(feature = "runtime"))]
pub fn lock<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Runs both and returns both results.
#[cfg(not(feature = "runtime"))]
pub fn join<A, B>(first: impl FnOnce() -> A, second: impl FnOnce() -> B) -> (A, B) {
    (first(), second())
}

/// Traits that give collections and iterators the calls of `rayon`, one piece after the other.
#[cfg(not(feature = "runtime"))]
pub mod prelude {
    /// Collections that are given away piece by piece.
    pub trait IntoSerialIterator: IntoIterator + Sized {
        /// The pieces in order.
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }

    impl<I: IntoIterator> IntoSerialIterator for I {}

    /// Slices that are gone through piece by piece.
    pub trait SerialSlice<T> {
        /// The pieces in order.
        fn par_iter(&self) -> std::slice::Iter<'_, T>;
        /// The pieces in order, to be changed.
        fn par_iter_mut(&mut self) -> std::slice::IterMut<'_, T>;
        /// So many pieces at a time, to be changed.
        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T>;
    }

    impl<T> SerialSlice<T> for [T] {
        fn par_iter(&self) -> std::slice::Iter<'_, T> {
            self.iter()
        }

        fn par_iter_mut(&mut self) -> std::slice::IterMut<'_, T> {
            self.iter_mut()
        }

        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T> {
            self.chunks_mut(size)
        }
    }

    /// What parallel iterators can do beyond ordinary ones.
    pub trait SerialIterator: Iterator + Sized {
        /// Several results a piece, one after the other.
        fn flat_map_iter<I: IntoIterator>(self, each: impl FnMut(Self::Item) -> I) -> impl Iterator<Item = I::Item> {
            self.flat_map(each)
        }

        /// One result a piece, with memory that all pieces share.
        fn map_init<S, R>(
            self,
            init: impl FnOnce() -> S,
            mut each: impl FnMut(&mut S, Self::Item) -> R,
        ) -> impl Iterator<Item = R> {
            let mut shared = init();
            self.map(move |piece| each(&mut shared, piece))
        }

        /// Pieces that one thread takes at least: nothing to one thread.
        #[must_use]
        fn with_min_len(self, _: usize) -> Self {
            self
        }
    }

    impl<I: Iterator> SerialIterator for I {}
}
