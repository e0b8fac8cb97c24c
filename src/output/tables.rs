//! Tables in CSV. Every number is written with the fewest digits that read back as the same number.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use serde::Serialize;

use crate::grains::{Snapshot, sphere_volume};
use crate::observe::{History, SurfaceEnergy};
use crate::scheme::{GrainCollision, Observer, SurfaceHit};

/// Writes a header and rows.
pub(super) fn table<R: Serialize>(
    out: &mut dyn Write,
    header: &[&str],
    rows: impl Iterator<Item = R>,
) -> io::Result<()> {
    let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    table.write_record(header).map_err(cause)?;
    for row in rows {
        table.serialize(row).map_err(cause)?;
    }
    table.flush()
}

/// The error of the file beneath the table: a full disk shall be told from a missing permission.
fn cause(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

/// `grains.csv`: all grains of a snapshot. Strengths in near-field forces have a column where not all are 1, so that the table can be the source
/// of another run.
pub(super) fn write_grains(out: &mut dyn Write, snapshot: &Snapshot<'_>) -> io::Result<()> {
    const HEADER: [&str; 12] = ["id", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "radius", "density"];
    let rows = snapshot.flights.iter().zip(snapshot.grains).map(|(flight, grain)| {
        let density = grain.mass / sphere_volume(flight.radius);
        let vectors = [flight.position, flight.velocity, grain.spin].map(|vector| [vector.x, vector.y, vector.z]);
        (grain.id, vectors, flight.radius, density)
    });
    if snapshot.grains.iter().all(|grain| grain.strength == 1.0) {
        return table(out, &HEADER, rows);
    }
    let strengths = snapshot.grains.iter().map(|grain| grain.strength);
    table(out, &[&HEADER[..], &["strength"]].concat(), rows.zip(strengths))
}

/// `series.csv`: the time history, with potential energies (since the start) in two more columns where forces act.
pub(super) fn write_series(out: &mut dyn Write, history: &History) -> io::Result<()> {
    const HEADER: [&str; 10] = [
        "time",
        "kinetic_energy",
        "surface_energy_first_hits",
        "surface_energy_repeated_hits",
        "surface_energy_all_hits",
        "dissipated_grain",
        "dissipated_surface",
        "grain_grain",
        "grain_surface",
        "inside",
    ];
    let rows = history.moments().iter().map(|moment| {
        let surface = [moment.surface_first, moment.surface_repeated, moment.surface_all];
        let dissipated = [moment.dissipated_grain, moment.dissipated_surface];
        let counts = [moment.grain_grain, moment.grain_surface, moment.inside];
        (moment.time, moment.kinetic_energy, surface, dissipated, counts)
    });
    if history.moments().iter().all(|moment| moment.gravity.is_none()) {
        return table(out, &HEADER, rows);
    }
    let potentials = history.moments().iter().map(|moment| [moment.near_field, moment.gravity]);
    table(out, &[&HEADER[..], &["potential_near_field", "potential_gravity"]].concat(), rows.zip(potentials))
}

/// `surface_hits.csv`: energy to the surface by hit order.
pub(super) fn write_surface_hits(out: &mut dyn Write, energy: &SurfaceEnergy) -> io::Result<()> {
    let rows = energy.by_order().iter().enumerate().map(|(index, tally)| {
        let parts = [tally.normal.value(), tally.tangential.value(), tally.spin.value()];
        (index + 1, tally.hits, tally.energy(), parts)
    });
    table(out, &["order", "hits", "energy", "normal", "tangential", "spin"], rows)
}

/// `events.csv`: every collision, written as it happens.
///
/// An observer cannot return an error, so the first one is kept, and nothing is written after it.
#[derive(Debug)]
pub struct EventTable<W: Write = BufWriter<File>> {
    table: csv::Writer<W>,
    error: Option<io::Error>,
}

impl<W: Write> EventTable<W> {
    /// Begins the table with its header.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(out: W) -> io::Result<Self> {
        let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(out);
        let header =
            ["time", "kind", "a", "b", "impulse_normal", "impulse_tangential", "approach_speed", "x", "y", "z"];
        table.write_record(header).map_err(cause)?;
        Ok(Self { table, error: None })
    }

    /// Whether a row could not be written.
    pub fn failed(&self) -> bool {
        self.error.is_some()
    }

    /// Ends the table.
    ///
    /// # Errors
    /// The first one of `out` since the table was begun.
    pub fn finish(mut self) -> io::Result<()> {
        match self.error {
            Some(error) => Err(error),
            None => self.table.flush(),
        }
    }

    fn row(&mut self, row: impl Serialize) {
        if self.error.is_none() {
            self.error = self.table.serialize(row).err().map(cause);
        }
    }
}

impl<W: Write> Observer for EventTable<W> {
    fn grain_collision(&mut self, event: &GrainCollision) {
        let numbers = [event.impulse_normal, event.impulse_tangential.norm(), event.approach_speed];
        let place = [event.position.x, event.position.y, event.position.z];
        self.row((event.time, "grain-grain", event.ids, numbers, place));
    }

    fn surface_hit(&mut self, event: &SurfaceHit) {
        let numbers = [event.impulse_normal, event.impulse_tangential.norm(), event.approach_speed];
        let place = [event.position.x, event.position.y, event.position.z];
        self.row((event.time, "grain-surface", event.id, event.element, numbers, place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grains::Grain;
    use crate::observe::fake_jet::FakeJet;
    use impinge_events::Flight;
    use nalgebra::Vector3;

    /// Numbers that a fixed number of digits would spoil.
    const AWKWARD: [f64; 6] = [0.1 + 0.2, 1e-300, -1.797_693_134_862_315_7e308, 5e-324, 1.0 / 3.0, -0.0];

    fn read(bytes: &[u8]) -> (Vec<String>, Vec<Vec<String>>) {
        let mut reader = csv::Reader::from_reader(bytes);
        let texts = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
        let header = texts(reader.headers().unwrap());
        (header, reader.records().map(|record| texts(&record.unwrap())).collect())
    }

    #[test]
    fn grains_read_back_to_the_bit() {
        let [x, y, z, u, v, w] = AWKWARD;
        let flight =
            Flight { position: Vector3::new(x, y, z), time: 0.0, velocity: Vector3::new(u, v, w), radius: 0.01 };
        let grain = Grain { id: 12, mass: 0.035, spin: Vector3::new(w, v, u), hits: 1, strength: 1.0 };
        let mut bytes = Vec::new();
        write_grains(&mut bytes, &Snapshot { time: 1.0, flights: &[flight], grains: &[grain] }).unwrap();
        let (header, rows) = read(&bytes);
        assert_eq!(header.join(","), "id,x,y,z,vx,vy,vz,wx,wy,wz,radius,density");
        assert_eq!(rows[0][0], "12");
        let bits: Vec<u64> = rows[0][1..].iter().map(|text| text.parse::<f64>().unwrap().to_bits()).collect();
        let density = 0.035 / sphere_volume(0.01);
        let expected: Vec<u64> = [x, y, z, u, v, w, w, v, u, 0.01, density].map(f64::to_bits).to_vec();
        assert_eq!(bits, expected);

        let weak = [grain, Grain { strength: x, ..grain }];
        bytes.clear();
        write_grains(&mut bytes, &Snapshot { time: 1.0, flights: &[flight; 2], grains: &weak }).unwrap();
        let (header, rows) = read(&bytes);
        assert_eq!(header.last().map(String::as_str), Some("strength"));
        let strengths: Vec<f64> = rows.iter().map(|row| row[12].parse().unwrap()).collect();
        assert_eq!(strengths, [1.0, x]);
    }

    #[test]
    fn every_event_is_a_row() {
        #[derive(Default)]
        struct Count(usize, usize, f64);
        impl Observer for Count {
            fn grain_collision(&mut self, event: &GrainCollision) {
                self.0 += 1;
                self.2 = event.impulse_normal;
            }
            fn surface_hit(&mut self, _event: &SurfaceHit) {
                self.1 += 1;
            }
        }
        let (mut bytes, mut count) = (Vec::new(), Count::default());
        let jet = FakeJet { grains: 500, ..FakeJet::default() };
        let mut events = EventTable::new(&mut bytes).unwrap();
        jet.run(&mut events);
        events.finish().unwrap();
        jet.run(&mut count); // the same jet again
        let Count(grain_grain, grain_surface, last_impulse) = count;
        let (header, rows) = read(&bytes);
        assert_eq!(header.join(","), "time,kind,a,b,impulse_normal,impulse_tangential,approach_speed,x,y,z");
        let of = |kind: &str| rows.iter().filter(|row| row[1] == kind).collect::<Vec<_>>();
        assert_eq!((of("grain-grain").len(), of("grain-surface").len()), (grain_grain, grain_surface));
        assert_eq!(of("grain-grain").last().unwrap()[4].parse::<f64>().unwrap().to_bits(), last_impulse.to_bits());
    }

    #[test]
    fn an_empty_table_still_has_its_header() {
        let mut bytes = Vec::new();
        write_surface_hits(&mut bytes, &SurfaceEnergy::default()).unwrap();
        assert_eq!(String::from_utf8(bytes).unwrap(), "order,hits,energy,normal,tangential,spin\n");
    }

    #[test]
    fn a_full_disk_is_reported_once_the_table_ends() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut events = EventTable::new(Full).unwrap();
        FakeJet::default().run(&mut events);
        assert!(events.failed());
        assert_eq!(events.finish().unwrap_err().kind(), io::ErrorKind::StorageFull);
    }
}
