//! Grains that keep coming out of a nozzle (Arbelaez et al. 2009, sections 2 and 8).

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::context::Context;
use super::radius::Radii;
use super::{brief, is_inside, just_touches, value};
use crate::grains::{NewGrain, sphere_volume};
use crate::scene::{Boundary, Flow, Invalid, NozzleShape, NozzleSource, Scene};

/// Places that are tried for a grain before it is deferred. With so many a twentieth of the opening that is free is found in
/// 96 of 100 attempts; more would only cost time where the opening is full.
const PLACES_PER_ATTEMPT: u32 = 64;

/// How long a deferred grain waits before the next attempt, in the time it takes to fly its own diameter. The grains
/// that are in its way have then moved on by a quarter of what they must.
const RETRY_FLIGHT: f64 = 0.25;

/// Places at which an opening is tried for an overlap with the surface; it is halved again and again where it is not clear of it.
///
/// They are a 64th of its width apart if the surface runs along all of the opening, and much nearer to each other if it comes near at the
/// rim only. Consequence: an overlap between such places may be passed over; grains then keep clear of it one by one.
const PLACES_PER_CHECK: usize = 1 << 14;

/// An opening through which grains enter the scene.
///
/// Grain number k (from 0) is due at start + (k + u_k) / flux, with u_k drawn evenly from 0 to 1: entries are irregular, but
/// never is the number of grains that are due more than one away from flux times duration. Each enters at a place drawn
/// evenly over the opening. Where no place is free the grain is deferred and tried again shortly after, with the same
/// radius (dropping it would favour small grains); those that wait behind it keep their own times, and so the flow catches
/// up as soon as there is room. What has been deferred is counted. A place is free where the grain overlaps no other and no surface:
/// the opening must be clear of the surface when the nozzle opens, but a moving one may reach it later.
///
/// The number flux follows from a volume fraction φ as φ A v / V, with A the area of the opening, v the speed and V the
/// mean volume of a grain. In a planar scene φ is an area fraction, A the width of the opening and V the mean area of the
/// circle in which a grain cuts the plane. Grains at the rim of a diverging jet advance by cos(divergence) less than
/// v; the flux does not count that (0.4 % at 5 degrees).
///
/// All times are simulated times, s.
#[derive(Clone, Debug)]
pub struct Nozzle {
    /// Its number among the sources of the scene.
    number: usize,
    opening: Opening,
    speed: f64,
    spin: Vector3<f64>,
    density: f64,
    strength: f64,
    radii: Radii,
    flux: f64,
    start: f64,
    stop: f64,
    rng: Pcg64Mcg,
    waiting: Waiting,
    entered: u64,
    deferred: u64,
}

/// In which surface of the scene a grain with this centre (m) and radius (m) lies the deepest, and how deep (m).
type Overlap<'a> = dyn Fn(Vector3<f64>, f64) -> Option<(usize, f64)> + 'a;

/// The grain that enters next.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    radius: f64,
    due: f64,
    deferred: bool,
}

impl Nozzle {
    /// The nozzle that is source number `number` of `scene`. A start before that of the run is put off until then.
    ///
    /// # Errors
    /// Values that are not finite, a speed, size, density, radius or flow that is not positive, an axis without direction,
    /// an opening that reaches beyond the domain, a flow that no packing of grains allows, a stop before the start.
    pub fn new(scene: &Scene, number: usize, source: &NozzleSource) -> Result<Self, Invalid> {
        let context = Context { scene, number, placed: 0 };
        let opening = Opening::new(source, &context)?;
        let speed = value::positive(&context.key("speed"), source.speed)?;
        let radii = context.radii(source.radius.as_ref())?;
        if scene.domain.boundary == Boundary::Periodic && radii.bounds().1.is_infinite() {
            let what =
                "a lognormal radius has no upper bound, and sooner or later a grain would be too large for the domain";
            let remedy = "in a periodic domain give the nozzle a constant, uniform or normal radius";
            return Err(Invalid::new(context.key("radius"), what, remedy));
        }
        let flux = flux(source.flow, &opening, speed, &radii, &context)?;
        let start = value::finite(&context.key("start"), source.start)?;
        let stop = match source.stop {
            None => f64::INFINITY,
            Some(stop) if value::finite(&context.key("stop"), stop)? > start => stop,
            Some(stop) => {
                return Err(Invalid::new(
                    context.key("stop"),
                    format!("{stop} is not after `start`, {start}"),
                    "give a later time, or leave it out for a nozzle that never stops",
                ));
            }
        };
        let mut nozzle = Self {
            number,
            opening,
            speed,
            spin: context.spin(source.spin)?,
            density: context.density(source.density)?,
            strength: context.strength()?,
            radii,
            flux,
            start: start.max(scene.run.start),
            stop,
            rng: context.rng(),
            waiting: Waiting { radius: 0.0, due: 0.0, deferred: false },
            entered: 0,
            deferred: 0,
        };
        nozzle.waiting = nozzle.next();
        Ok(nozzle)
    }

    /// When it opens, s.
    #[must_use]
    pub(crate) fn opens(&self) -> f64 {
        self.start
    }

    /// Refuses a nozzle whose grains would enter inside the surface.
    ///
    /// `surface_overlap` gets the centre (m) and radius (m) of a grain and says in which surface of the scene it lies the deepest when the
    /// nozzle opens and how deep (m), or `None`.
    ///
    /// # Errors
    /// A place of the opening where a grain of mean radius overlaps a surface.
    pub(crate) fn check_clear(&self, surface_overlap: &Overlap<'_>) -> Result<(), Invalid> {
        let radius = self.radii.mean();
        let Some((place, surface, depth)) = self.opening.overlap(radius, surface_overlap) else { return Ok(()) };
        let [x, y, z] = place.data.0[0].map(brief);
        Err(Invalid::new(
            format!("source[{}].centre", self.number),
            format!(
                "a grain of radius {} m that enters at ({x}, {y}, {z}) overlaps surface[{surface}] by {depth:.3e} m",
                brief(radius)
            ),
            "move the nozzle away from the surface, or make its opening smaller",
        ))
    }

    /// When the next grain is due (s), or `None` when the nozzle has stopped.
    #[must_use]
    pub fn due(&self) -> Option<f64> {
        (self.waiting.due < self.stop).then_some(self.waiting.due)
    }

    /// Lets the grain that is due at `time` (s) in, at a place for whose centre (m) and radius (m) `is_free` says yes.
    ///
    /// `None` if none of the places that are tried is free: the grain is deferred, and [`due`](Self::due) says until when,
    /// which is always later than `time`. So only finitely many attempts are made at one time.
    pub fn enter(&mut self, time: f64, is_free: &mut dyn FnMut(Vector3<f64>, f64) -> bool) -> Option<NewGrain> {
        let radius = self.waiting.radius;
        for _ in 0..PLACES_PER_ATTEMPT {
            let (position, direction) = self.opening.draw(&mut self.rng);
            if is_free(position, radius) {
                self.entered += 1;
                self.waiting = self.next();
                if self.waiting.due < time {
                    self.defer(time); // it waited behind this one
                }
                let velocity = self.speed * direction;
                let Self { spin, density, strength, .. } = *self;
                return Some(NewGrain { position, velocity, spin, radius, density, strength });
            }
        }
        self.defer((time + RETRY_FLIGHT * 2.0 * radius / self.speed).max(time.next_up()));
        None
    }

    fn defer(&mut self, due: f64) {
        self.deferred += u64::from(!self.waiting.deferred);
        self.waiting.deferred = true;
        self.waiting.due = due;
    }

    /// How many grains have entered.
    #[must_use]
    pub fn entered(&self) -> u64 {
        self.entered
    }

    /// How many grains had to wait after they were due, for a free place or for a grain before them.
    #[must_use]
    pub fn deferred(&self) -> u64 {
        self.deferred
    }

    /// How many grains should have entered by `time` (s) and have not, to within one: what the flow falls short of.
    #[must_use]
    pub fn missing(&self, time: f64) -> u64 {
        let duration = (time.min(self.stop) - self.start).max(0.0);
        ((duration * self.flux) as u64).saturating_sub(self.entered)
    }

    /// Grains per second.
    #[must_use]
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// Draws the grain that follows those that have entered.
    fn next(&mut self) -> Waiting {
        let due = self.start + (self.entered as f64 + self.rng.random::<f64>()) / self.flux;
        Waiting { radius: self.radii.draw(&mut self.rng), due, deferred: false }
    }
}

/// Grains per second, by number or from the volume fraction, if that many grains can pass the opening at all.
fn flux(flow: Flow, opening: &Opening, speed: f64, radii: &Radii, context: &Context<'_>) -> Result<f64, Invalid> {
    let planar = context.planar();
    let grain = if planar { PI * radii.mean_square() } else { sphere_volume(1.0) * radii.mean_cube() };
    let (key, given, flux) = match flow {
        Flow::VolumeFraction(fraction) => {
            let key = context.key("flow.volume_fraction");
            let fraction = value::positive(&key, fraction)?;
            (key, fraction, fraction * opening.area(0.0) * speed / grain)
        }
        Flow::NumberFlux(flux) => {
            let key = context.key("flow.number_flux");
            let flux = value::positive(&key, flux)?;
            (key, flux, flux)
        }
    };
    // Grains whose centres pass the opening fill at most the opening and the radius around it, at the densest packing.
    let most = radii.densest_packing(planar) * opening.area(radii.mean()) * speed / grain;
    if flux <= most {
        return Ok(flux);
    }
    Err(Invalid::new(
        key,
        format!(
            "{given} asks for {flux:.4e} grains per second, more than the densest packing lets through, {most:.4e}"
        ),
        format!("ask for at most {:.3e}; a random stream reaches about half of that", given * most / flux),
    ))
}

/// Shape, place and direction of an opening.
#[derive(Clone, Debug)]
struct Opening {
    centre: Vector3<f64>,
    axis: Vector3<f64>,
    /// Unit vector across the opening, and half its extent along it, m.
    across: Vector3<f64>,
    half_width: f64,
    /// The third direction, and what the opening does along it.
    along: Vector3<f64>,
    outline: Outline,
    /// Divergence at the rim, rad.
    divergence: f64,
}

/// What an opening is along its third direction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outline {
    /// As wide as across: a circle.
    Round,
    /// A slot of this half breadth, m.
    Straight(f64),
    /// There is no third direction: a planar scene.
    Line,
}

impl Opening {
    fn new(source: &NozzleSource, context: &Context<'_>) -> Result<Self, Invalid> {
        let planar = context.planar();
        let centre = value::vector(&context.key("centre"), source.centre)?;
        let axis = value::direction(&context.key("axis"), source.axis)?;
        if planar {
            value::zero_in_plane(&context.key("centre"), &centre, &[1])?;
            value::zero_in_plane(&context.key("axis"), &axis, &[1])?;
        }
        let divergence = value::not_negative(&context.key("divergence"), source.divergence)?;
        if divergence >= 90.0 {
            return Err(Invalid::new(
                context.key("divergence"),
                format!("{divergence} degrees turn grains back into the nozzle"),
                "give less than 90 degrees",
            ));
        }
        let (width, outline, along) = match &source.shape {
            NozzleShape::Circle { diameter } => {
                // Any direction that is not parallel to the axis will do.
                let aside = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
                (value::positive(&context.key("shape.circle.diameter"), *diameter)?, Outline::Round, aside)
            }
            NozzleShape::Slot { width, breadth, along } => {
                let width = value::positive(&context.key("shape.slot.width"), *width)?;
                let key = context.key("shape.slot.along");
                if planar {
                    (width, Outline::Line, Vector3::y())
                } else {
                    let breadth = value::positive(&context.key("shape.slot.breadth"), *breadth)?;
                    (width, Outline::Straight(0.5 * breadth), value::direction(&key, *along)?)
                }
            }
        };
        let (along, outline) = if planar { (Vector3::y(), Outline::Line) } else { (along, outline) };
        let along = across_axis(along, axis).ok_or_else(|| {
            Invalid::new(
                context.key("shape.slot.along"),
                "is parallel to the axis of the nozzle",
                "give the direction of the breadth, across the axis",
            )
        })?;
        let opening = Self {
            centre,
            axis,
            across: along.cross(&axis),
            half_width: 0.5 * width,
            along,
            outline,
            divergence: divergence.to_radians(),
        };
        opening.check_inside(context)?;
        Ok(opening)
    }

    fn check_inside(&self, context: &Context<'_>) -> Result<(), Invalid> {
        let reach = Vector3::from_fn(|i, _| match self.outline {
            Outline::Round => self.half_width * self.across[i].hypot(self.along[i]),
            Outline::Straight(half) => self.half_width * self.across[i].abs() + half * self.along[i].abs(),
            Outline::Line => self.half_width * self.across[i].abs(),
        });
        let domain = &context.scene.domain;
        if is_inside(domain, self.centre - reach) && is_inside(domain, self.centre + reach) {
            return Ok(());
        }
        let [low, high] = [self.centre - reach, self.centre + reach].map(|corner| corner.data.0[0]);
        Err(Invalid::new(
            context.key("centre"),
            format!(
                "the opening reaches from {low:?} to {high:?}, beyond the domain, which goes from {:?} to {:?}",
                domain.min, domain.max
            ),
            "move the nozzle or enlarge the domain",
        ))
    }

    /// A place of the opening (m) where a grain of this radius (m) overlaps a surface, which one, and how deep (m).
    ///
    /// A rectangle of the opening is clear when a grain larger by half its diagonal is clear of the surface in its middle, or in the place
    /// nearest to that: no place of a round opening is further from it.
    fn overlap(&self, radius: f64, surface_overlap: &Overlap<'_>) -> Option<(Vector3<f64>, usize, f64)> {
        let breadth = match self.outline {
            Outline::Round => self.half_width,
            Outline::Straight(half) => half,
            Outline::Line => 0.0,
        };
        // Middle and half sides of rectangles that are not known to be clear, m across and along; the largest first.
        let mut rectangles = VecDeque::from([([0.0, 0.0], [self.half_width, breadth])]);
        for _ in 0..PLACES_PER_CHECK {
            let (middle, mut half) = rectangles.pop_front()?;
            let place = self.nearest(middle);
            match surface_overlap(place, radius) {
                Some((surface, depth)) if !just_touches(depth, radius) => return Some((place, surface, depth)),
                _ => {}
            }
            if surface_overlap(place, radius + half[0].hypot(half[1])).is_some() {
                let longer = usize::from(half[1] > half[0]);
                half[longer] *= 0.5;
                for step in [-half[longer], half[longer]] {
                    let mut middle = middle;
                    middle[longer] += step;
                    rectangles.push_back((middle, half));
                }
            }
        }
        None
    }

    /// The place of the opening (m) that is nearest to a point of its plane, given in m across and along.
    fn nearest(&self, point: [f64; 2]) -> Vector3<f64> {
        let outside = if self.outline == Outline::Round { point[0].hypot(point[1]) / self.half_width } else { 0.0 };
        let [x, y] = point.map(|x| x / outside.max(1.0));
        let mut place = self.centre + x * self.across + y * self.along;
        if self.outline == Outline::Line {
            place.y = 0.0;
        }
        place
    }

    /// Area (m²) of the opening and a margin (m) around it; in a planar scene the width, m.
    fn area(&self, margin: f64) -> f64 {
        let half_width = self.half_width + margin;
        match self.outline {
            Outline::Round => PI * half_width.powi(2),
            Outline::Straight(half) => 4.0 * half_width * (half + margin),
            Outline::Line => 2.0 * half_width,
        }
    }

    /// A place of the opening, drawn evenly (m), and the direction in which a grain flies from there.
    ///
    /// The grain at distance xi from the axis of a circle, or from the middle of a slot, flies (xi / rim) divergence
    /// outwards (Arbelaez et al. 2009, section 8).
    fn draw(&self, rng: &mut Pcg64Mcg) -> (Vector3<f64>, Vector3<f64>) {
        let mut signed = |half: f64| half * (2.0 * rng.random::<f64>() - 1.0);
        let (xi, outwards, aside) = match self.outline {
            Outline::Line => (signed(1.0), self.across, 0.0),
            Outline::Straight(half) => (signed(1.0), self.across, signed(half)),
            Outline::Round => {
                let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
                (rng.random::<f64>().sqrt(), cos * self.across + sin * self.along, 0.0)
            }
        };
        let (sin, cos) = (xi * self.divergence).sin_cos();
        let mut position = self.centre + xi * self.half_width * outwards + aside * self.along;
        let mut direction = cos * self.axis + sin * outwards;
        if self.outline == Outline::Line {
            (position.y, direction.y) = (0.0, 0.0);
        }
        (position, direction)
    }
}

/// The unit vector across `axis` nearest to `direction`; `None` where they are parallel to rounding.
fn across_axis(direction: Vector3<f64>, axis: Vector3<f64>) -> Option<Vector3<f64>> {
    /// Sine of the angle to the axis below which rounding would choose the direction.
    const PARALLEL: f64 = 1e-9;
    (direction - direction.dot(&axis) * axis).try_normalize(PARALLEL)
}
