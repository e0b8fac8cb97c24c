//! The fast calendar: buckets of time, after Paul, J. Comput. Phys. 221 (2007) 615.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::staging::Staging;
use super::{Calendar, Event, Kind, Plan, earlier, never};
use crate::blocks::Blocks;
use crate::prefetch::prefetch;
use crate::table::{Table, make_room, table};

/// Buckets for each event: a turn of them is about as long as most events wait when one comes in each.
const BUCKETS_PER_EVENT: usize = 1;
/// Half as many where there are more events than these: it costs no time there, and memory counts.
const MOST_FINE: usize = 1 << 17;
/// The buckets are laid out anew when fewer events than this part of their number have come in a turn, or more than so many times their number in one of
/// so many parts of it; where there are few buckets, more than that.
const FEWEST_EVENTS: f64 = 0.25;
const MOST_EVENTS: usize = 4;
const PARTS_OF_TURN: i64 = 16;
const FEWEST_IN_A_CROWD: usize = 256;
/// Buckets are no narrower than this part of what the median of the waiting times would make them: or a turn of them would be too short.
const NARROWEST: f64 = 1.0 / 64.0;
/// So many events before theirs it is said who comes, as many as came in the buckets of late, ...
const EVENTS_ANNOUNCED: i64 = 8;
/// ... but so many buckets before at the least, and at the most.
const ANNOUNCED: [i64; 2] = [8, 24];
/// So many buckets before that the owners in each are fetched from memory.
const FETCHED: i64 = 8;
/// From so many buckets on their lists do not fit the nearest caches: an owner enters one that is at least so many ahead only after some others, once the list
/// has come from memory.
const MANY: usize = 1 << 14;
const FAR: i64 = 64;
const _: () = assert!(FAR / 2 > ANNOUNCED[1]);
/// At most so many waiting times, and at least half of that where there are more, tell the median of all.
const SAMPLED: usize = 1 << 10;
/// The buckets are laid out anew when more entries than so many times their number wait: most of them are of events that are no longer.
const MOST_WAITING: usize = 4;

/// A calendar in which an owner is rescheduled in a time that does not grow with the number of owners.
///
/// Events that come later than the present bucket of time wait in lists without an order, one for each of the next buckets (a turn of them); those that come
/// after the turn are in no list, and are looked for when the next one begins. Whoever is rescheduled enters another list and stays in the one it was in: that is found
/// out when its bucket becomes the present one. Then the events of this bucket go into a heap, and so do those that are scheduled into it from then on. About one
/// event is in a bucket, so the heap is all but empty. Should thousands come at once, it is a heap still.
#[derive(Clone, Debug)]
pub struct Buckets {
    owners: Table<Owner>,
    /// The owners in each bucket of a turn, and some whose event is no longer there.
    lists: Blocks,
    /// Events of the present bucket and all before it, and some that are no longer so.
    present: BinaryHeap<Entry>,
    /// The present bucket, counted from `origin`.
    now: i64,
    /// The bucket with which the turn began: a multiple of their number.
    turn: i64,
    /// Start of bucket 0, s.
    origin: f64,
    /// Buckets in a second, 1/s; 0 where they are not laid out.
    rate: f64,
    /// Entries in the lists of this turn.
    waiting: usize,
    /// Events that have come into the heap in this turn.
    passed: usize,
    /// The same since the buckets were laid out, until this turn, and how many owners there were whenever one began.
    passed_before: usize,
    /// The first bucket of the present part of a turn, and how many events had come by then.
    part: (i64, usize),
    /// The bucket up to which it was said who comes.
    announced: i64,
    /// So many buckets before theirs it is said.
    ahead: i64,
    /// Owners that are yet to enter their lists.
    staging: Staging,
}

/// All that belongs to an owner, in one cache line: what the calendar needs of it is then at hand for who asks for its plan.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Owner {
    event: Event,
    plan: Plan,
}

const _: () = assert!(size_of::<Owner>() == 64);

impl Default for Owner {
    fn default() -> Self {
        Self { event: never(Kind::Exit), plan: Plan::default() }
    }
}

/// An event of `owner` in the heap.
#[derive(Clone, Copy, Debug)]
struct Entry {
    event: Event,
    owner: u32,
}

impl Ord for Entry {
    /// The earliest is the greatest: what a heap gives first.
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        other.event.order(other.owner, &self.event, self.owner)
    }
}

impl PartialOrd for Entry {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }

    /// What the heap asks most; the times tell nearly always.
    #[inline]
    fn le(&self, other: &Self) -> bool {
        !self.event.is_before(self.owner, &other.event, other.owner)
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

impl Default for Buckets {
    fn default() -> Self {
        Self {
            owners: table([]),
            lists: Blocks::new(1),
            present: BinaryHeap::new(),
            now: 0,
            turn: 0,
            origin: 0.0,
            rate: 0.0,
            waiting: 0,
            passed: 0,
            passed_before: 0,
            part: (0, 0),
            announced: 0,
            ahead: ANNOUNCED[0],
            staging: Staging::default(),
        }
    }
}

/// The bucket of a time (s), counted from `origin` (s), where there are `rate` in a second.
#[inline]
fn bucket_of(time: f64, origin: f64, rate: f64) -> i64 {
    // Saturates. Times before the origin are in negative buckets, all of which are past.
    ((time - origin) * rate) as i64
}

impl Buckets {
    /// How many buckets are in a turn: a power of two.
    #[inline]
    fn buckets(&self) -> i64 {
        self.lists.lists() as i64
    }

    /// The bucket of a time.
    #[inline]
    fn bucket(&self, time: f64) -> i64 {
        bucket_of(time, self.origin, self.rate)
    }

    /// The list of a bucket.
    #[inline]
    fn list(&self, bucket: i64) -> usize {
        (bucket & (self.buckets() - 1)) as usize
    }

    /// Whether a bucket comes in a later turn.
    #[inline]
    fn is_later(&self, bucket: i64) -> bool {
        bucket - self.turn >= self.buckets()
    }

    /// Puts the event of `owner` where it belongs.
    #[inline]
    fn enter(&mut self, owner: u32, event: Event) {
        let bucket = self.bucket(event.time);
        if bucket <= self.now {
            // Earlier than this bucket are only events that are found once more, after time went back: they are no crowd.
            self.passed += usize::from(bucket == self.now);
            return self.present.push(Entry { event, owner });
        }
        // Those of later turns are looked for when their turn comes.
        if self.is_later(bucket) {
            return;
        }
        self.waiting += 1;
        let list = self.list(bucket);
        if self.lists.lists() >= MANY && bucket - self.now >= FAR {
            self.lists.fetch(list);
            if let Some((owner, list)) = self.staging.enter(owner, list, bucket) {
                self.lists.add(list, owner);
            }
        } else {
            self.lists.add(list, owner);
        }
    }

    /// Lets all owners that are yet to enter their lists do so.
    #[cold]
    fn list_staged(&mut self) {
        for (owner, list) in self.staging.take() {
            self.lists.add(list, owner);
        }
    }

    /// Goes on to the next bucket that holds an event; tells whether there is one.
    fn go_on(&mut self) -> bool {
        while self.present.is_empty() {
            if self.waiting == 0 {
                if !self.start_turn() {
                    return false;
                }
                continue;
            }
            self.now += 1;
            // Before their buckets are announced, or owners on their way into these lists would not be.
            if self.staging.earliest() - FAR / 2 < self.now {
                self.list_staged();
            }
            if self.now - self.part.0 == self.buckets() / PARTS_OF_TURN {
                self.part = (self.now, self.passed);
            }
            let list = self.list(self.now);
            let (waiting, passed) = (&mut self.waiting, &mut self.passed);
            self.lists.drain(list, |owner| {
                *waiting -= 1;
                let event = self.owners[owner as usize].event;
                if bucket_of(event.time, self.origin, self.rate) == self.now {
                    *passed += 1;
                    self.present.push(Entry { event, owner });
                }
            });
        }
        true
    }

    /// Starts the turn in which the next event is. Nobody waits but for later turns; tells whether there is anybody.
    #[cold]
    fn start_turn(&mut self) -> bool {
        let buckets_of_events = EVENTS_ANNOUNCED * self.buckets() / self.passed.max(1) as i64;
        self.ahead = buckets_of_events.clamp(ANNOUNCED[0], ANNOUNCED[1]);
        self.passed_before += self.passed;
        let few = (self.passed as f64) < FEWEST_EVENTS * self.buckets() as f64;
        // To lay out costs as much as that many events, however few there are in a turn.
        if few && self.passed_before as i64 > self.buckets() {
            return self.lay_out();
        }
        // To look through all owners, which are side by side, is faster than to follow a list through all of the memory.
        let first = self.owners.iter().map(|owner| owner.event.time).fold(f64::INFINITY, earlier);
        if first == f64::INFINITY {
            return false;
        }
        let next = self.bucket(first);
        self.turn = next & !(self.buckets() - 1);
        // The bucket before the next one: nobody's is past.
        self.now = next.saturating_sub(1);
        self.passed_before += self.owners.len();
        (self.passed, self.part) = (0, (self.now, 0));
        for owner in 0..self.owners.len() as u32 {
            let event = self.owners[owner as usize].event;
            if event.time < f64::INFINITY {
                self.enter(owner, event);
            }
        }
        true
    }

    /// Whether so many events came lately, or so many entries wait, that it pays to lay the buckets out anew.
    #[inline]
    fn is_crowded(&self) -> bool {
        let crowd = MOST_EVENTS * self.lists.lists() / PARTS_OF_TURN as usize;
        let crowded = self.passed - self.part.1 > crowd.max(FEWEST_IN_A_CROWD);
        crowded || self.waiting > (MOST_WAITING * self.lists.lists()).max(FEWEST_IN_A_CROWD)
    }

    /// Chooses the number and the width of the buckets by the events that there are, and by how many came lately: where few owners have most of the
    /// events, these come much faster than half of all in the median time. Tells whether there is any.
    #[cold]
    fn lay_out(&mut self) -> bool {
        let times = || self.owners.iter().map(|owner| owner.event.time).filter(|&time| time < f64::INFINITY);
        let count = times().count();
        if count == 0 {
            self.clear();
            return false;
        }
        let mut sample: Vec<f64> = times().step_by(count.div_ceil(SAMPLED)).collect();
        let middle = sample.len() / 2;
        let median = *sample.select_nth_unstable_by(middle, f64::total_cmp).1;
        self.origin = times().fold(f64::INFINITY, earlier);
        // Half of the events come until the median.
        let until_median = (0.5 * count as f64 / (median - self.origin)).min(f64::MAX);
        let lately = self.rate * (self.passed - self.part.1) as f64 / ((self.now - self.part.0) as f64 + 1.0);
        self.rate = lately.clamp(until_median, until_median / NARROWEST).min(f64::MAX);
        let coarse = usize::from(count > MOST_FINE);
        self.lists.reset((BUCKETS_PER_EVENT * count).next_power_of_two() >> coarse);
        self.present.clear();
        (self.now, self.turn, self.announced, self.ahead) = (0, 0, 0, ANNOUNCED[0]);
        (self.waiting, self.passed, self.passed_before, self.part) = (0, 0, 0, (0, 0));
        self.staging = Staging::default();
        for owner in 0..self.owners.len() as u32 {
            let event = self.owners[owner as usize].event;
            if event.time < f64::INFINITY {
                self.enter(owner, event);
            }
        }
        // A crowd that is there from the start cannot be told apart by another layout.
        self.part = (0, self.passed);
        true
    }
}

impl Calendar for Buckets {
    fn reserve(&mut self, owners: usize) {
        if self.owners.is_empty() {
            make_room(&mut self.owners, owners);
        }
        let owners = owners.max(self.owners.len());
        self.owners.resize(owners, Owner::default());
    }

    // In one piece with what chose the event, or it goes through memory, and is read there in other pieces than it was written.
    #[inline(always)]
    fn schedule(&mut self, owner: u32, event: Event) {
        if owner as usize >= self.owners.len() {
            self.reserve(owner as usize + 1);
        }
        let ours = &mut self.owners[owner as usize].event;
        if *ours == event {
            return;
        }
        // Where the one before has entered it is passed over when its turn comes.
        *ours = event;
        if event.time < f64::INFINITY && self.rate > 0.0 {
            self.enter(owner, event);
        }
    }

    fn cancel(&mut self, owner: u32) {
        if let Some(owner) = self.owners.get_mut(owner as usize) {
            owner.event = never(Kind::Exit);
        }
    }

    #[inline]
    fn next(&mut self) -> Option<(u32, Event)> {
        if self.rate == 0.0 || self.is_crowded() {
            self.lay_out();
        }
        loop {
            while let Some(&Entry { event, owner }) = self.present.peek() {
                if self.owners[owner as usize].event == event {
                    return Some((owner, event));
                }
                self.present.pop();
            }
            if !self.go_on() {
                return None;
            }
        }
    }

    fn clear(&mut self) {
        self.owners.iter_mut().for_each(|owner| owner.event = never(Kind::Exit));
        self.lists.reset(1);
        self.present.clear();
        (self.now, self.turn, self.announced, self.ahead) = (0, 0, 0, ANNOUNCED[0]);
        (self.waiting, self.passed, self.passed_before, self.part) = (0, 0, 0, (0, 0));
        self.staging = Staging::default();
        self.rate = 0.0;
    }

    fn coming(&mut self, owners: &mut Vec<u32>) {
        let buckets = self.buckets();
        let last = self.now.saturating_add(self.ahead).min(self.turn + (buckets - 1));
        self.announced = self.announced.max(self.now);
        while self.announced < last {
            self.announced += 1;
            let list = |bucket: i64| (bucket & (buckets - 1)) as usize;
            self.lists.first(list(self.announced + FETCHED)).numbers().for_each(|owner| self.fetch(owner));
            let comes = |&owner: &u32| self.bucket(self.owners[owner as usize].event.time) == self.announced;
            owners.extend(self.lists.numbers(list(self.announced)).filter(comes));
        }
    }

    #[inline]
    fn fetch(&self, owner: u32) {
        prefetch(&self.owners, owner as usize);
    }

    #[inline]
    fn plan(&self, owner: u32) -> &Plan {
        &self.owners[owner as usize].plan
    }

    #[inline]
    fn plan_mut(&mut self, owner: u32) -> &mut Plan {
        &mut self.owners[owner as usize].plan
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;
    use crate::calendar::PlainCalendar;

    /// Random schedules and cancellations with many equal times: both calendars give the same events in the same order.
    #[test]
    fn buckets_equal_the_plain_calendar() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let (mut fast, mut plain) = (Buckets::default(), PlainCalendar::default());
        for step in 0..200_000 {
            let owner = random.random_range(0..1 + step / 500);
            if random.random_range(0..4) == 0 {
                fast.cancel(owner);
                plain.cancel(owner);
            } else {
                let kind =
                    [Kind::Crossing, Kind::Review, Kind::Grains, Kind::Surface, Kind::Exit][random.random_range(0..5)];
                let time = f64::from(random.random_range(-20..20)) / 8.0;
                let event = Event { time, kind, partner: random.random_range(0..9) };
                fast.schedule(owner, event);
                plain.schedule(owner, event);
            }
            let ends = (fast.next(), plain.next());
            let same = match ends {
                // A pair may stand in the calendar under both of its grains: then either may come first.
                (Some((a, x)), Some((b, y))) => x.order(a, &y, b) == Ordering::Equal,
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "step {step}: {ends:?}");
            if let Some((owner, _)) = ends.0.filter(|_| step % 3 == 0) {
                fast.cancel(owner);
                plain.cancel(owner);
            }
        }
    }

    /// The hold model with waits over many orders of magnitude, a crowd at one moment, and new starts: whatever the width of the buckets is by then.
    #[test]
    fn buckets_equal_the_plain_calendar_at_any_pace() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(8);
        let (mut fast, mut plain) = (Buckets::default(), PlainCalendar::default());
        let owners = 300;
        for start in 0..40 {
            fast.clear();
            plain.clear();
            let pace = 10_f64.powi(start % 20 - 10);
            let schedule = |fast: &mut Buckets, plain: &mut PlainCalendar, owner, time| {
                let event = Event { time, kind: Kind::Grains, partner: owner };
                fast.schedule(owner, event);
                plain.schedule(owner, event);
            };
            let mut wait = |scatter: i32| pace * 10_f64.powf(random.random_range(-1.0..1.0) * f64::from(scatter));
            (0..owners).for_each(|owner| schedule(&mut fast, &mut plain, owner, wait(start % 7)));
            for step in 0..4000 {
                let (ours, theirs) = (fast.next(), plain.next());
                assert_eq!(ours, theirs, "start {start}, step {step}");
                let Some((owner, event)) = ours else { break };
                // Now and then everybody waits for the same moment.
                let pause = if step / 500 % 4 == 3 { pace } else { wait(start % 7) };
                let time = if step / 500 % 4 == 3 { (event.time / pace).ceil() * pace } else { event.time };
                schedule(&mut fast, &mut plain, owner, time + pause);
            }
        }
    }

    /// What comes beyond the last bucket that has a number is in the last one; to look ahead of that overflowed (seen without optimisation).
    #[test]
    fn an_event_beyond_all_buckets_comes_last() {
        let mut calendar = Buckets::default();
        let times = [0.0, 1e-30, 1e10];
        for (owner, time) in (0..).zip(times) {
            calendar.schedule(owner, Event { time, kind: Kind::Grains, partner: 0 });
        }
        for (owner, time) in (0..).zip(times) {
            assert_eq!(calendar.next().map(|(owner, event)| (owner, event.time)), Some((owner, time)));
            calendar.coming(&mut Vec::new());
            calendar.cancel(owner);
        }
        assert_eq!(calendar.next(), None);
    }

    /// Events that had not come when the calendar was cleared came back, or were looked for without end, if none was scheduled after that.
    #[test]
    fn a_cleared_calendar_went_on_with_what_had_waited() {
        let mut calendar = Buckets::default();
        let event = |time| Event { time, kind: Kind::Grains, partner: 0 };
        (0..64).for_each(|owner| calendar.schedule(owner, event(f64::from(owner * owner))));
        for owner in 0..20 {
            assert_eq!(calendar.next(), Some((owner, event(f64::from(owner * owner)))));
            calendar.schedule(owner, event(1e4 + f64::from(owner)));
        }
        calendar.clear();
        assert_eq!(calendar.next(), None);
        calendar.schedule(3, event(1.0));
        assert_eq!(calendar.next(), Some((3, event(1.0))));
    }

    /// So many owners that some are on their way into their lists when they are scheduled anew, cancelled, or their turn comes.
    #[test]
    fn many_buckets_equal_the_plain_calendar() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let owners = MANY as u32;
        let (mut fast, mut plain) = (Buckets::default(), PlainCalendar::default());
        let mut now = 0.0;
        for step in 0..3 * owners {
            // One after the other at first; then some again and again, and those that had the next event, which have few more.
            let next = if step % 4 == 3 { fast.next().map(|(owner, _)| owner) } else { None };
            let owner = match next {
                _ if step < owners => step,
                Some(owner) => owner,
                None if step % 2 == 0 => random.random_range(0..owners),
                None => random.random_range(0..32),
            };
            if step > owners && random.random_range(0..8) == 0 {
                fast.cancel(owner);
                plain.cancel(owner);
            } else {
                let later = if random.random_range(0..4) == 0 { 0.001 } else { 1.0 };
                let event = Event { time: now + later * random.random::<f64>(), kind: Kind::Review, partner: 0 };
                fast.schedule(owner, event);
                plain.schedule(owner, event);
            }
            if step >= owners {
                assert_eq!(fast.next(), plain.next(), "step {step}");
                now = plain.next().map_or(now, |(_, event)| event.time);
            }
        }
        assert!(fast.lists.lists() >= MANY);
        while let Some((owner, event)) = plain.next() {
            assert_eq!(fast.next(), Some((owner, event)));
            fast.cancel(owner);
            plain.cancel(owner);
        }
        assert_eq!(fast.next(), None);
    }

    /// The buckets were laid out anew for each of thousands of events at one moment.
    #[test]
    fn a_crowd_at_one_moment_was_laid_out_for_each_of_its_events() {
        let mut calendar = Buckets::default();
        let event = |owner| Event { time: 1.0, kind: Kind::Grains, partner: owner };
        (0..10_000).for_each(|owner| calendar.schedule(owner, event(owner)));
        for owner in 0..10_000 {
            assert_eq!(calendar.next(), Some((owner, event(owner))));
            assert!(!calendar.is_crowded());
            calendar.cancel(owner);
        }
    }

    /// Two cores go back in time now and then: what came once more was taken for a crowd, and the buckets became ten times too narrow.
    #[test]
    fn what_came_once_more_was_taken_for_a_crowd() {
        let mut calendar = Buckets::default();
        let event = |time| Event { time, kind: Kind::Grains, partner: 0 };
        (0..1000).for_each(|owner| calendar.schedule(owner, event(f64::from(owner))));
        (0..500).for_each(|owner| calendar.schedule(owner, event(1000.0 + f64::from(owner))));
        assert_eq!(calendar.next(), Some((500, event(500.0))));
        let rate = calendar.rate;
        for step in 0..10_000 {
            let earlier = event(400.0 + 0.01 * f64::from(step));
            calendar.schedule(500, earlier);
            assert_eq!(calendar.next(), Some((500, earlier)));
        }
        assert_eq!(calendar.rate, rate);
    }

    /// Where a gas cools its events become few in a bucket, and who comes was said too late for the memory.
    #[test]
    fn who_came_was_said_too_late_where_events_became_few() {
        let mut calendar = Buckets::default();
        let event = |time| Event { time, kind: Kind::Grains, partner: 0 };
        (0..1024).for_each(|owner| calendar.schedule(owner, event(f64::from(owner))));
        assert_eq!(calendar.next(), Some((0, event(0.0))));
        let rate = calendar.rate;
        let (mut said, mut now) = (vec![None; 1024], 0.0);
        while now < 4000.0 {
            let mut coming = Vec::new();
            calendar.coming(&mut coming);
            coming.iter().for_each(|&owner| said[owner as usize] = Some(now));
            let (owner, first) = calendar.next().expect("all wait");
            now = first.time;
            // From the second turn on a third as many.
            calendar.schedule(owner, event(if now < 1024.0 { 1024.0 + 3.0 * now } else { now + 3072.0 }));
            if now > 3200.0 {
                let early = said[owner as usize].map_or(0.0, |then| now - then);
                assert!(early > f64::from(ANNOUNCED[1] as i32 - 4), "{early} s before {now} s");
            }
        }
        assert_eq!(calendar.rate, rate);
    }

    /// Entries of events that were given up went on to wait, and a calendar with nothing else was laid out without end.
    #[test]
    fn a_calendar_whose_events_were_all_given_up_is_empty() {
        let mut calendar = Buckets::default();
        let event = |time| Event { time, kind: Kind::Grains, partner: 0 };
        (0..64).for_each(|owner| calendar.schedule(owner, event(f64::from(owner))));
        // Two owners have all events but the first, again and again: more than there are buckets come, and few in a turn.
        for step in 0..2000 {
            let (owner, first) = calendar.next().expect("all wait");
            calendar.schedule(owner, event(first.time + if owner < 2 { 0.01 } else { 100.0 + f64::from(step) }));
            // Given up and given back: each time an entry more that is of no use.
            calendar.schedule(63, event(1e3 + f64::from(step % 7)));
        }
        (0..64).for_each(|owner| calendar.cancel(owner));
        assert_eq!((calendar.next(), calendar.waiting), (None, 0));
        calendar.schedule(5, event(1e5));
        assert_eq!(calendar.next(), Some((5, event(1e5))));
    }

    /// An owner whose event is moved to and fro does not fill the memory with entries of those it had.
    #[test]
    fn entries_that_are_of_no_use_do_not_grow_without_end() {
        let mut calendar = Buckets::default();
        let event = |time| Event { time, kind: Kind::Grains, partner: 0 };
        (0..1000).for_each(|owner| calendar.schedule(owner, event(f64::from(owner))));
        for step in 0..1_000_000 {
            calendar.schedule(500, event(500.0 + f64::from(step % 100)));
            assert_eq!(calendar.next(), Some((0, event(0.0))));
        }
        assert!(calendar.waiting <= 2 * MOST_WAITING * calendar.lists.lists(), "{}", calendar.waiting);
    }

    #[test]
    fn an_event_that_never_comes_is_none() {
        let mut calendar = Buckets::default();
        calendar.schedule(3, Event { time: f64::INFINITY, kind: Kind::Grains, partner: 1 });
        assert_eq!(calendar.next(), None);
    }
}
