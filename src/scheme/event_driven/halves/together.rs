//! Two cores that hand work to each other some thousand times a second, and do not fall asleep in between: to be woken takes as long as fifty events.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Does both at once in the thread pool of rayon. Whoever is ready first waits awake for the other.
pub(super) fn both<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    let (taken, ended) = (AtomicBool::new(false), AtomicUsize::new(0));
    let wait = || {
        while ended.load(Ordering::Acquire) < 2 {
            spin_loop();
        }
    };
    rayon::join(
        || {
            let result = {
                let _end = End(&ended);
                first()
            };
            // Where no other core was free this one does both, one after the other.
            if taken.load(Ordering::Acquire) {
                wait();
            }
            result
        },
        || {
            taken.store(true, Ordering::Release);
            let result = {
                let _end = End(&ended);
                second()
            };
            wait();
            result
        },
    )
}

/// Does what only one core can do, and keeps the other one awake meanwhile.
pub(super) fn alone<R>(work: impl FnOnce() -> R) -> R {
    beside(work, || {})
}

/// Does the first here, and the second meanwhile on another core. Whoever is ready first waits awake for the other.
pub(super) fn beside<R>(here: impl FnOnce() -> R, there: impl FnOnce() + Send) -> R {
    let (taken, ended) = (AtomicBool::new(false), AtomicUsize::new(0));
    let wait = || {
        while ended.load(Ordering::Acquire) < 2 {
            spin_loop();
        }
    };
    rayon::in_place_scope(|scope| {
        let (taken, ended, wait) = (&taken, &ended, &wait);
        scope.spawn(move |_| {
            taken.store(true, Ordering::Release);
            {
                let _end = End(ended);
                there();
            }
            wait();
        });
        let result = {
            let _end = End(ended);
            here()
        };
        if taken.load(Ordering::Acquire) {
            wait();
        }
        result
    })
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
