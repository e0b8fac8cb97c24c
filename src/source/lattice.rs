//! Grains on a lattice that fills a box.

use nalgebra::Vector3;

use super::context::Context;
use crate::grains::NewGrain;
use crate::scene::{Arrangement, Boundary, Domain, Invalid, LatticeSource};

/// Places the grains, cell by cell with x running fastest.
pub(super) fn fill(lattice: &LatticeSource, context: &Context<'_>) -> Result<Vec<NewGrain>, Invalid> {
    let bounds = context.bounds(lattice.min, lattice.max)?;
    let radii = context.radii(lattice.radius.as_ref())?;
    let density = context.density(lattice.density)?;
    let motion = context.motion(lattice.velocity, lattice.thermal_speed, lattice.spin)?;
    if context.planar() && lattice.cells[1] != 1 {
        return Err(Invalid::new(
            context.key("cells"),
            format!("{} cells along y, but the scene is planar", lattice.cells[1]),
            "give 1 cell along y",
        ));
    }
    let places = places(lattice.arrangement, context.planar());
    let count = lattice.cells.iter().map(|&cells| u128::from(cells)).product::<u128>() * places.len() as u128;
    context.check_count("cells", count)?;

    let mut rng = context.rng();
    let side =
        (bounds.upper - bounds.lower).zip_map(&Vector3::from(lattice.cells), |side, cells| side / f64::from(cells));
    let mut grains = Vec::with_capacity(count as usize);
    let [nx, ny, nz] = lattice.cells;
    for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
        let corner = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
        for place in places {
            let position = bounds.lower + side.component_mul(&(corner + Vector3::from(*place)));
            let radius = radii.draw(&mut rng);
            grains.push(motion.grain(position, radius, density, &mut rng));
        }
    }
    Ok(grains)
}

/// Places in a unit cell of side 1, evenly about its middle.
///
/// In a planar scene the layer of the lattice that lies in the plane: one place in a cubic cell, two in a face-centred one.
fn places(arrangement: Arrangement, planar: bool) -> &'static [[f64; 3]] {
    match (arrangement, planar) {
        (Arrangement::Cubic, _) => &[[0.5, 0.5, 0.5]],
        (Arrangement::FaceCentred, true) => &[[0.25, 0.25, 0.25], [0.75, 0.25, 0.75]],
        (Arrangement::FaceCentred, false) => {
            &[[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]]
        }
    }
}

/// Half the least distance between two places of the lattice (m); infinite where there is only one place.
pub(super) fn largest_radius(lattice: &LatticeSource, domain: &Domain) -> f64 {
    let places = places(lattice.arrangement, domain.planar);
    let mut side = Vector3::zeros();
    let mut steps = [0; 3];
    for axis in (0..3).filter(|&axis| !(domain.planar && axis == 1)) {
        let extent = lattice.max[axis] - lattice.min[axis];
        side[axis] = extent / f64::from(lattice.cells[axis]);
        // Along a periodic axis the lattice goes on with its own image.
        let repeats = domain.boundary == Boundary::Periodic && extent == domain.max[axis] - domain.min[axis];
        steps[axis] = i32::from(lattice.cells[axis] > 1 || repeats);
    }
    let mut least = f64::INFINITY;
    for (k, j, i) in (-steps[2]..=steps[2])
        .flat_map(|k| (-steps[1]..=steps[1]).flat_map(move |j| (-steps[0]..=steps[0]).map(move |i| (k, j, i))))
    {
        let shift = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
        for (number, a) in places.iter().enumerate() {
            for (other, b) in places.iter().enumerate() {
                if (i, j, k) != (0, 0, 0) || number != other {
                    let offset = side.component_mul(&(shift + Vector3::from(*b) - Vector3::from(*a)));
                    least = least.min(offset.norm());
                }
            }
        }
    }
    0.5 * least
}
