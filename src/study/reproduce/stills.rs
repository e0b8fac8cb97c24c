//! Where the grains of a jet are at a few moments, and how a jet looks from the side.

use nalgebra::Vector3;

use crate::grains::Snapshot;
use crate::scheme::Observer;
use crate::shown::{Axis, Map};

/// One grain at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Its centre, m.
    pub(super) place: Vector3<f64>,
    /// Its velocity, m/s.
    pub(super) velocity: Vector3<f64>,
}

/// Keeps all frames of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Stills(pub(super) Vec<(f64, Vec<Seen>)>);

impl Observer for Stills {
    fn frame(&mut self, _: u32, snapshot: &Snapshot<'_>) {
        let seen = |flight: &impinge_events::Flight| Seen { place: flight.position, velocity: flight.velocity };
        self.0.push((snapshot.time, snapshot.flights.iter().map(seen).collect()));
    }
}

/// What a side view shows: the window, and how finely.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// From where to where along x, m.
    pub(super) x: [f64; 2],
    /// From where to where along z, m.
    pub(super) z: [f64; 2],
    /// Cells along x and z.
    pub(super) cells: [usize; 2],
    /// Grains per area (1/m²) of the brightest colour; more is not brighter.
    pub(super) most: f64,
}

/// Grains per area as seen along y, a mean over copies; without colour where there are none.
pub(super) fn side_view(name: &'static str, title: String, shows: String, copies: &[&[Seen]], view: View) -> Map {
    let View { x, z, cells: [nx, nz], most } = view;
    let area = (x[1] - x[0]) / nx as f64 * (z[1] - z[0]) / nz as f64;
    let mut counts = vec![vec![0_u32; nz]; nx];
    for seen in copies.iter().copied().flatten() {
        let along = |value: f64, [low, high]: [f64; 2], cells: usize| {
            let index = ((value - low) / (high - low) * cells as f64).floor();
            (0.0..cells as f64).contains(&index).then_some(index as usize)
        };
        if let (Some(column), Some(row)) = (along(seen.place.x, x, nx), along(seen.place.z, z, nz)) {
            counts[column][row] += 1;
        }
    }
    let shown = |count: &u32| (*count > 0).then(|| f64::from(*count) / (area * copies.len() as f64));
    Map {
        name,
        title,
        shows,
        x: Axis::linear("x / m", x[0], x[1]),
        y: Axis::linear("z / m", z[0], z[1]),
        columns: counts.iter().map(|column| column.iter().map(shown).collect()).collect(),
        legend: "grains per m²".into(),
        most,
        grey: "no grain".into(),
        line: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_view_counts_what_is_in_it() {
        let seen = |x, z| Seen { place: Vector3::new(x, 7.0, z), velocity: Vector3::zeros() };
        let view = View { x: [0.0, 2.0], z: [0.0, 1.0], cells: [2, 1], most: 1.0 };
        let (one, other) = ([seen(0.5, 0.5), seen(0.2, 0.1), seen(2.0, 0.5)], [seen(0.9, 0.9)]);
        let map = side_view("side", String::new(), String::new(), &[&one, &other], view);
        assert_eq!(map.columns, [[Some(1.5)], [None]]);
    }
}
