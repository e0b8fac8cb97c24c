//! Many runs on all cores.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::Settings;
use crate::scene::{Invalid, Scene};
use crate::scheme::{Broken, Observer};
use crate::simulation::Simulation;

/// Why a study has no result.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Somebody broke it off.
    #[error("the study was broken off")]
    BrokenOff,
    /// A scene of the study cannot be run.
    #[error("a scene of the study cannot be run: {0}")]
    Scene(#[from] Invalid),
    /// A run of the study failed.
    #[error("a run of the study failed: {0}")]
    Run(#[from] Broken),
}

/// Runs the scene of each task to its end, and gives what `measure` makes of its observer, in the order of the tasks.
///
/// Every run is a function of its scene alone, so the number of threads cannot change a bit of the results. Tasks are begun in their
/// order: put long ones first, so that no core waits for the last.
///
/// # Errors
/// The first that a run gives.
pub fn run_all<K: Sync, O: Observer + Default, T: Send>(
    tasks: &[K],
    settings: &Settings<'_>,
    scene: impl Fn(&K) -> Scene + Sync,
    measure: impl Fn(O) -> T + Sync,
) -> Result<Vec<T>, Error> {
    run_each(tasks, settings, scene, |_| O::default(), measure)
}

/// The same with an observer that is made for each scene, as what a scene measures is.
///
/// # Errors
/// The first that a run gives.
pub fn run_each<K: Sync, O: Observer, T: Send>(
    tasks: &[K],
    settings: &Settings<'_>,
    scene: impl Fn(&K) -> Scene + Sync,
    observer: impl Fn(&Scene) -> O + Sync,
    measure: impl Fn(O) -> T + Sync,
) -> Result<Vec<T>, Error> {
    let done = AtomicUsize::new(0);
    let watch = || (settings.watch)(done.load(Ordering::Relaxed) as f64 / tasks.len() as f64);
    let run = |task: &K| {
        if watch().is_break() {
            return Err(Error::BrokenOff);
        }
        let scene = scene(task);
        let mut observer = observer(&scene);
        let mut simulation = Simulation::new(&scene, "".as_ref())?;
        if simulation.run(&mut observer, &mut |_| watch())?.interrupted {
            return Err(Error::BrokenOff);
        }
        done.fetch_add(1, Ordering::Relaxed);
        Ok(measure(observer))
    };
    // One task at a time: tasks differ by a factor of a million.
    tasks.par_iter().with_max_len(1).map(run).collect()
}

/// Nobody watches, nobody breaks off.
#[cfg(test)]
pub(super) fn unwatched(quick: bool) -> Settings<'static> {
    Settings { quick, seed: 1, watch: &|_| std::ops::ControlFlow::Continue(()) }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::scene::Interference;
    use crate::study::reproduce::{Energies, Jet};

    fn jets() -> Vec<Jet> {
        let jet = Jet { grains: 200, interference: Interference::All, ..Jet::reference() };
        (1..=6).map(|seed| Jet { seed, ..jet }).collect()
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| run_all(&jets(), &unwatched(true), Jet::scene, Energies::of).expect("they run"))
        };
        let one = with(1);
        assert_eq!(one, with(3));
        assert_ne!(one[0], one[1], "seeds differ, and keep their order");
    }

    #[test]
    fn a_study_can_be_broken_off() {
        let settings = Settings { watch: &|_| ControlFlow::Break(()), ..unwatched(true) };
        let result = run_all(&jets(), &settings, Jet::scene, Energies::of);
        assert!(matches!(result, Err(Error::BrokenOff)), "{result:?}");
    }
}
