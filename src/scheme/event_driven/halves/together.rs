//! Two cores that hand work to each other some thousand times a second, and do not fall asleep in between: to be woken takes as long as fifty events.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Does both at once in the thread pool of rayon. Whoever is ready first waits awake for the other.
pub(super) fn both<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    let pair = Pair::default();
    rayon::join(|| pair.here(first), || pair.there(second))
}

/// The same, where the first has to stay in this thread.
pub(super) fn beside<R>(here: impl FnOnce() -> R, there: impl FnOnce() + Send) -> R {
    let pair = Pair::default();
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| pair.there(there));
        pair.here(here)
    })
}

/// Does what only one core can do, and keeps the other one awake meanwhile.
pub(super) fn alone<R>(work: impl FnOnce() -> R) -> R {
    beside(work, || {})
}

/// How far two have come that work at once.
#[derive(Default)]
struct Pair {
    /// Whether another core has taken the second part.
    taken: AtomicBool,
    /// How many parts have ended.
    ended: AtomicUsize,
}

impl Pair {
    /// The part of the core that began.
    fn here<R>(&self, work: impl FnOnce() -> R) -> R {
        let result = self.work(work);
        // Where no other core was free this one does both, one after the other.
        if self.taken.load(Ordering::Acquire) {
            self.wait();
        }
        result
    }

    /// The part that another core takes if one is free.
    fn there<R>(&self, work: impl FnOnce() -> R) -> R {
        self.taken.store(true, Ordering::Release);
        let result = self.work(work);
        self.wait();
        result
    }

    fn work<R>(&self, work: impl FnOnce() -> R) -> R {
        let _end = End(&self.ended);
        work()
    }

    fn wait(&self) {
        while self.ended.load(Ordering::Acquire) < 2 {
            spin_loop();
        }
    }
}

/// Notes that something has ended, also where it panics: nobody waits for it without end.
struct End<'a>(&'a AtomicUsize);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    fn pool(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
    }

    #[test]
    fn both_are_done_on_one_thread_and_on_two() {
        for threads in [1, 2] {
            let sum = pool(threads).install(|| {
                (0..1000).fold(0, |sum, number| {
                    let (first, second) = both(|| number, || 2 * number);
                    let mut third = 0;
                    let both = beside(|| first + second, || third = number);
                    sum + alone(|| both + third)
                })
            });
            assert_eq!(sum, 4 * 999 * 1000 / 2);
        }
    }

    #[test]
    fn nobody_waits_for_who_has_panicked() {
        for threads in [1, 2] {
            pool(threads).install(|| {
                for late in [false, true] {
                    let fail = |fails: bool| assert!(!fails, "as it should");
                    assert!(catch_unwind(|| both(|| fail(!late), || fail(late))).is_err());
                }
                assert!(catch_unwind(AssertUnwindSafe(|| alone(|| panic!("as it should")))).is_err());
                assert!(catch_unwind(|| beside(|| {}, || panic!("as it should"))).is_err());
            });
        }
    }
}
