//! What flights can hit besides each other.

use nalgebra::Vector3;

use crate::{Bend, Flight};

/// What lies ahead of a flight on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outlook {
    /// The flight touches `element` at `time` (s, epoch time), and nothing of the surface before.
    Hit {
        /// Time of contact, s.
        time: f64,
        /// Which plane or triangle.
        element: u32,
    },
    /// Nothing of the surface is touched before this time (s); infinity when it never is.
    ClearUntil(f64),
}

/// Where and how a grain touches the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// Unit vector from the surface to the centre of the grain.
    pub normal: Vector3<f64>,
    /// Signed distance between centre and surface less the radius, m; negative when they overlap.
    pub gap: f64,
    /// Velocity of the surface at the contact, m/s.
    pub velocity: Vector3<f64>,
}

/// A surface made of numbered elements (planes, triangles), each moving at a constant velocity or at rest.
///
/// The contact time of a flight with one element must be a pure function of that flight's stored state and the element:
/// it may not depend on `until` nor on how often it is asked. `until` only limits how far ahead an index has to look.
pub trait Surface {
    /// The first contact of `flight` at or after its local time, looking at least until `until` (s, epoch time).
    ///
    /// A contact after `until` may be reported or not. Equal times are won by the lowest element.
    fn first_contact(&self, flight: &Flight, until: f64) -> Outlook;

    /// As [`first_contact`](Self::first_contact) for a grain that is accelerated: `flight` is its chord, `bend` how it departs from it.
    ///
    /// Left out, the chord itself is taken, which errs by the square of the sub-step.
    fn first_contact_bent(&self, flight: &Flight, bend: &Bend, until: f64) -> Outlook {
        let _ = bend;
        self.first_contact(flight, until)
    }

    /// Calls `visit` with every contact of `flight`, as it is at its local time, whose gap is less than `reach` (m): one for each direction in
    /// which the surface carries the grain. Needed only where grains come to rest.
    fn touches(&self, flight: &Flight, reach: f64, visit: &mut dyn FnMut(u32, SurfaceContact)) {
        let _ = (flight, reach, visit);
    }

    /// The contact between `element` and a flight that has been advanced to the moment of contact.
    fn contact(&self, element: u32, flight: &Flight) -> SurfaceContact;

    /// The largest speed of any part of it along an axis, m/s; a surface that moves must say so, or times late in an epoch in which all
    /// grains rest are coarse.
    fn speed(&self) -> f64 {
        0.0
    }

    /// Starts a new epoch `duration` seconds later: moving parts go on by their velocity, times count from there.
    fn start_epoch(&mut self, duration: f64);
}

/// No surface at all: grains meet only each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoSurface;

impl Surface for NoSurface {
    fn first_contact(&self, _flight: &Flight, _until: f64) -> Outlook {
        Outlook::ClearUntil(f64::INFINITY)
    }

    fn contact(&self, element: u32, _flight: &Flight) -> SurfaceContact {
        unreachable!("there is no element {element} where there is no surface")
    }

    fn start_epoch(&mut self, _duration: f64) {}
}
