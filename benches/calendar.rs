//! The fast calendar against the plain one in the hold model: the first event is taken and its owner gets another one later
//! (Jones 1986, Comm. ACM 29, 300). One iteration is one such hold.
//!
//! `cargo bench --bench calendar`

mod support;

use criterion::{Criterion, criterion_group, criterion_main};
use impinge_events::calendar::{Buckets, Calendar, Event, Kind, PlainCalendar};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Exp1};
use rand_pcg::Pcg64;

/// Waiting times drawn beforehand, so that no random number is drawn while the clock runs.
const WAITS: usize = 1 << 12;

fn event(time: f64) -> Event {
    Event { time, kind: Kind::Grains, partner: 0 }
}

fn hold<C: Calendar>(c: &mut Criterion, name: &str, owners: u32) {
    let mut random = Pcg64::seed_from_u64(1);
    let mut wait = || -> f64 { Exp1.sample(&mut random) };
    let waits: Vec<f64> = (0..WAITS).map(|_| wait()).collect();
    let mut calendar = C::default();
    calendar.reserve(owners as usize);
    (0..owners).for_each(|owner| calendar.schedule(owner, event(wait())));
    let mut turn = waits.iter().cycle();
    c.bench_function(&format!("hold of {owners}/{name}"), |b| {
        b.iter(|| {
            let (Some((owner, first)), Some(wait)) = (calendar.next(), turn.next()) else { return };
            calendar.schedule(owner, event(first.time + wait));
        });
    });
}

fn calendar(c: &mut Criterion) {
    for owners in [1_000, 10_000, 100_000] {
        hold::<Buckets>(c, "fast", owners);
        hold::<PlainCalendar>(c, "plain", owners);
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = calendar }
criterion_main!(benches);
