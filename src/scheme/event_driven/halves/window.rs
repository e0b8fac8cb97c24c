//! One half of the grains for a short time, and the way back.

use impinge_events::calendar::Calendar;
use impinge_events::{Flight, Surface};
use rustc_hash::FxHashMap;

use super::log::{Carried, Happened, Log};
use super::sharing::Sharing;
use super::{EventDriven, Renewal};
use crate::scene::Interference;
use crate::scheme::Broken;

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// Resolves all events up to `until` (s, epoch time) into `log`.
    pub(super) fn run_window(
        &mut self,
        half: usize,
        until: f64,
        sharing: &Sharing,
        log: &mut Log,
    ) -> Result<(), Broken> {
        log.clear();
        self.encounters.forget_crossings();
        while let Some((time, encounter)) = self.next_before(until) {
            self.encounters.soon().iter().for_each(|&grain| sharing.fetch(grain));
            let mut event = Happened::new(time, encounter, log.records.len());
            let number = log.events.len() as u32;
            let mut belong = event.grains().map(|grain| sharing.belongs_to(half, grain));
            // What happens across the cut the first half tells.
            event.is_ours = if half == 0 { belong.any(|ours| ours) } else { belong.all(|ours| ours) };
            if event.grains().any(|grain| sharing.is_shared(grain)) {
                log.shared.push((number, event));
            }
            log.events.push(event);
            log.flights.push(self.encounters.before());
            let grains = event.pair();
            if !self.rows.is_empty() {
                log.rows.push(grains.map(|grain| self.rows[grain as usize]));
            }
            let carried = grains.map(|grain| Carried::by(&self.grains[grain as usize]));
            self.resolve(time, encounter, log)?;
            for (grain, carried) in event.grains().zip(carried) {
                if Carried::by(&self.grains[grain as usize]) != carried {
                    log.carried.push((number, grain, carried));
                }
                let flight = self.encounters.flight(grain);
                log.fastest = log.fastest.max(sharing.speed(flight));
                if sharing.belongs_to(half, grain) && sharing.may_change(half, grain, flight, time) {
                    log.to_watch.push(grain);
                }
            }
            if self.outrun {
                log.outrun = true;
                return Ok(());
            }
        }
        Ok(())
    }

    /// Finds the grains of this half whose copies have to change at `now` (s, epoch time), and what they become.
    pub(super) fn find_changes(&self, half: usize, now: f64, sharing: &Sharing, log: &mut Log) {
        let has_to_change = |&grain: &u32| {
            sharing.belongs_to(half, grain) && sharing.has_to_change(half, grain, self.encounters.flight(grain), now)
        };
        let watched = sharing.watched[half].iter().chain(&log.to_watch).copied();
        log.found_for = Some(now);
        log.to_change.clear();
        log.to_change.extend(watched.filter(has_to_change).map(|grain| self.as_it_is(grain)));
    }

    /// What a copy of a grain becomes if it is made like this one.
    pub(super) fn as_it_is(&self, grain: u32) -> Renewal {
        let (flight, row) = (*self.encounters.flight(grain), self.rows.get(grain as usize).copied());
        Renewal { grain, state: Some((flight, self.grains[grain as usize], row)) }
    }

    /// Undoes the events of `log` from number `first` on, and goes back to `now` (s, epoch time), before them.
    pub(super) fn undo(&mut self, log: &mut Log, first: usize, now: f64) {
        let mut changed: FxHashMap<u32, Flight> = FxHashMap::default();
        for number in (first..log.events.len()).rev() {
            for (k, (grain, flight)) in log.flights_of(number).enumerate() {
                changed.insert(grain, flight);
                if let Some(rows) = log.rows.get(number) {
                    self.rows[grain as usize] = rows[k];
                }
            }
        }
        while let Some((_, grain, Carried { spin, hits })) =
            log.carried.pop_if(|(number, ..)| *number as usize >= first)
        {
            let grain = &mut self.grains[grain as usize];
            (grain.spin, grain.hits) = (spin, hits);
        }
        changed.keys().for_each(|&grain| self.lift(grain));
        for (&grain, flight) in &changed {
            self.put_down(grain, *flight, now);
        }
        self.encounters.turn_back(now);
        if let Some(event) = log.events.get(first) {
            log.records.truncate(event.told as usize);
        }
        log.events.truncate(first);
        log.flights.truncate(first);
        log.rows.truncate(first);
        log.found_for = None;
        self.outrun = false;
        (self.mark, self.since_mark) = (now, 0);
    }

    /// Takes a grain out, if it is there, for the other half to know.
    pub(super) fn lift(&mut self, grain: u32) {
        if self.encounters.is_inside(grain) {
            self.encounters.lift(grain);
        }
    }

    /// Puts a grain that is not there into this state at `now` (s, epoch time).
    pub(super) fn put_down(&mut self, grain: u32, flight: Flight, now: f64) {
        self.encounters.put_down(grain, flight, self.is_stopped_by_surface(grain), now);
    }

    /// Whether the surface still stops a grain.
    pub(super) fn is_stopped_by_surface(&self, grain: u32) -> bool {
        let once = matches!(self.laws.interference, Interference::FirstOrder | Interference::RemovedOnFirstCollision);
        !once || self.grains[grain as usize].hits == 0
    }
}

#[cfg(test)]
mod tests {
    use impinge_events::{Domain, NoSurface};
    use nalgebra::Vector3;

    use super::*;
    use crate::grains::NewGrain;
    use crate::law::{ContactLaw, Friction};
    use crate::scheme::{Collapse, Laws};

    /// An event at the very end of a window was undone, and copies got the states that had been found after it.
    #[test]
    fn what_was_found_before_an_event_was_undone_is_not_used() -> Result<(), Broken> {
        let ball = |x: f64, vx: f64| NewGrain {
            position: Vector3::x() * x,
            velocity: Vector3::x() * vx,
            spin: Vector3::zeros(),
            radius: 0.5,
            density: 1.0,
            strength: 1.0,
        };
        let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
        let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
        let balls = [ball(0.0, 1.0), ball(3.0, 0.0)];
        let mut engine: EventDriven<NoSurface> = EventDriven::new(&balls, NoSurface, Domain::unbounded(), laws, 0.0);
        let (sharing, mut log) = (Sharing::of(&engine, 0.0), Log::default());
        engine.run_window(0, 2.0, &sharing, &mut log)?;
        engine.find_changes(0, 2.0, &sharing, &mut log);
        assert_eq!((log.events.len(), log.found_for), (1, Some(2.0)));
        engine.undo(&mut log, 0, 2.0);
        assert_eq!((log.events.len(), log.found_for), (0, None));
        Ok(())
    }
}
