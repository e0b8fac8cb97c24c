//! Paper 000, figures 12 to 16: stress of a circular nozzle over the angle of attack.

use super::impinging::{DYNAMIC, Impinging, Measured, STATIC, Spot, mean, run_copies};
use super::p000_fig4::stress_maps;
use super::trend::{Trend, difference, listed, nearness};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "000-fig12",
    title: "Figures 12 to 16: stress under a circular nozzle at 0, 10, 20, 30 and 60 degrees",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 8, fig. 12 to 16",
    statement: "At 0 degrees stresses are radially symmetric, the normal stress is nearly constant under the nozzle and decays outside; the shear is zero in the middle and largest at some radius. At \
                10 degrees the normal stress grows slightly with x/L, the region without shear lies at higher x/L, and the shear is largest near the negative edge. At 20 degrees there is no region without \
                shear, the normal stress is largest at the positive edge and the shear at higher x/L. At 30 degrees the normal stress is nearly constant but for a maximum at the positive edge, where the \
                shear is largest too. At 60 degrees both have the same pattern, with the maximum near the positive edge.",
    compute,
};

/// Angles (degrees), and how much longer each is measured than the first.
const ANGLES: [(f64, f64); 5] = [(0.0, 1.0), (10.0, 1.0), (20.0, 1.5), (30.0, 2.0), (60.0, 6.0)];
/// Harmonics of a radially symmetric stress are less than this part of its mean.
const SYMMETRIC: f64 = 0.05;
/// A nearly constant stress changes by less than this part.
const CONSTANT: f64 = 0.15;
/// A stress that is nearly zero is less than this part of its maximum.
const ZERO: f64 = 0.25;
/// Half the breadth (in widths) of the strip along x in which stresses are compared.
const STRIP: f64 = 0.25;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (duration, copies) = if settings.quick { (250.0, 2) } else { (1_200.0, 4) };
    let jet = |(angle, longer): (f64, f64)| Impinging { angle, duration: duration * longer, ..Impinging::round() };
    let jets = run_copies(&ANGLES.map(jet), copies, settings)?;
    let mut report = Report::default();
    let [upright, ten, twenty, thirty, sixty] = jets.as_slice() else { return Ok(report) };
    test_upright(upright, &mut report);
    test_ten(upright, ten, &mut report);
    test_twenty(ten, twenty, &mut report);
    test_thirty(thirty, &mut report);
    test_sixty(sixty, &mut report);
    report.tables.push(table(&jets));
    report.pictures.extend(jets.iter().flat_map(stress_maps));
    report.pictures.extend(charts(&jets));
    Ok(report)
}

fn radius(spot: &Spot) -> f64 {
    spot.x.hypot(spot.y)
}

/// Shear outwards: `shear` is positive towards -x and `across` towards -y.
fn radial(spot: &Spot) -> f64 {
    -(spot.shear * spot.x + spot.across * spot.y) / radius(spot)
}

fn ring(jet: &Measured, from: f64, to: f64, of: fn(&Spot) -> f64) -> Estimate {
    jet.derived(|spots| mean(spots, |spot| (from..to).contains(&radius(spot)), of))
}

fn test_upright(jet: &Measured, report: &mut Report) {
    for (what, of) in [("normal stress", (|spot| spot.normal) as fn(&Spot) -> f64), ("radial shear", radial)] {
        let harmonic = |order: i32, turn: f64| {
            jet.derived(|spots| {
                let near = || spots.iter().filter(|spot| radius(spot) < 0.8);
                let wave = |spot: &Spot| (f64::from(order) * spot.y.atan2(spot.x) - turn).cos();
                near().map(|spot| of(spot) * wave(spot)).sum::<f64>() / near().map(of).sum::<f64>()
            })
        };
        let harmonics = [(1, 0.0), (1, 90.0_f64.to_radians()), (2, 0.0), (2, 90.0_f64.to_radians())]
            .map(|(order, turn)| harmonic(order, turn));
        let largest = harmonics.into_iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs())).unwrap_or_default();
        report.decide(
            format!(
                "0 degrees: {what} is radially symmetric: its first and second harmonics are below {:.0} % of its mean",
                100.0 * SYMMETRIC
            ),
            format!("the largest of four is {} %", largest * 100.0),
            nearness(largest, 0.0, SYMMETRIC),
        );
    }
    // Parts of the nozzle's radius, of half a width.
    let rings = [(0.0, 0.15), (0.15, 0.25), (0.25, 0.35), (0.35, 0.45), (0.45, 0.6), (0.6, 0.8), (0.8, 1.0)];
    let rings_of = |of: fn(&Spot) -> f64| rings.map(|(from, to)| (0.5 * (from + to), ring(jet, from, to, of)));
    let normal = rings_of(|spot| spot.normal);
    let within = difference(normal[0].1, normal[3].1) * normal[0].1.value.recip();
    report.decide(
        format!(
            "0 degrees: the normal stress is constant within {:.0} % under the nozzle (from the middle to r = 0.4 L)",
            100.0 * CONSTANT
        ),
        format!("it falls by {} %; over r / L: {}", within * 100.0, listed(&normal)),
        nearness(within, 0.0, CONSTANT),
    );
    let outside = normal[6].1 * normal[0].1.value.recip();
    report.decide(
        "0 degrees: it decays outside to less than a quarter (at r = 0.9 L)",
        format!("{} %", outside * 100.0),
        Estimate { value: 0.25 - outside.value, error: outside.error },
    );
    let shear = rings_of(radial);
    let most = shear.iter().max_by(|a, b| a.1.value.total_cmp(&b.1.value)).copied().unwrap_or_default();
    let middle = shear[0].1;
    report.decide(
        format!(
            "0 degrees: the shear is nearly zero in the middle (less than {:.0} % of its maximum at r < 0.15 L)",
            100.0 * ZERO
        ),
        format!("{middle} there, {} at r = {:.2} L; over r / L: {}", most.1, most.0, listed(&shear)),
        Estimate { value: ZERO * most.1.value - middle.value, error: middle.error.hypot(ZERO * most.1.error) },
    );
    let beyond = difference(most.1, shear[6].1);
    report.decide(
        "0 degrees: the shear has its maximum at a radius and falls beyond it",
        format!("the maximum at r = {:.2} L is {beyond} above the shear at 0.9 L", most.0),
        Estimate { value: beyond.value.min(difference(most.1, middle).value), error: beyond.error },
    );
}

/// Thirds of the effective region along x: the negative edge, the middle and the positive edge.
fn thirds(jet: &Measured, of: fn(&Spot) -> f64) -> [Estimate; 3] {
    [(-0.95, -0.5), (-0.35, 0.35), (0.5, 0.95)].map(|(from, to)| zone(jet, from, to, of))
}

/// Mean over a part of the strip along x, in halves of the footprint.
fn zone(jet: &Measured, from: f64, to: f64, of: fn(&Spot) -> f64) -> Estimate {
    let half = jet.jet.half_footprint();
    jet.derived(|spots| mean(spots, |spot| spot.y.abs() < STRIP && (from..to).contains(&(spot.x / half)), of))
}

/// What one of three is above the larger of the others.
fn lead(thirds: [Estimate; 3], of: usize) -> Estimate {
    let others = (0..3).filter(|&third| third != of).map(|third| difference(thirds[of], thirds[third]));
    others.min_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or_default()
}

fn told(thirds: [Estimate; 3]) -> String {
    format!("{} at the negative edge, {} in the middle, {} at the positive edge", thirds[0], thirds[1], thirds[2])
}

/// Where along x the shear changes its sign, in widths.
fn without_shear(jet: &Measured) -> Estimate {
    let half = jet.jet.half_footprint();
    jet.derived(|spots| {
        let mut row: Vec<f64> = spots.iter().map(|spot| spot.x).filter(|x| x.abs() < half + 0.3).collect();
        row.sort_by(f64::total_cmp);
        row.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
        let at = |x: f64| mean(spots, |spot| spot.y.abs() < STRIP && (spot.x - x).abs() < 0.2, |spot| spot.shear);
        let values: Vec<(f64, f64)> = row.into_iter().map(|x| (x, at(x))).collect();
        let crossing = values.windows(2).find(|pair| pair[0].1 > 0.0 && pair[1].1 <= 0.0);
        crossing.map_or(f64::NAN, |pair| pair[0].0 + (pair[1].0 - pair[0].0) * pair[0].1 / (pair[0].1 - pair[1].1))
    })
}

fn test_ten(upright: &Measured, ten: &Measured, report: &mut Report) {
    let normal = thirds(ten, |spot| spot.normal);
    report.decide(
        "10 degrees: the normal stress grows with x/L in the effective region",
        told(normal),
        difference(normal[2], normal[0]),
    );
    let places = [upright, ten].map(without_shear);
    report.decide(
        "10 degrees: the region without shear lies at a higher x/L than at 0 degrees",
        format!("x / L = {} at 0 degrees, {} at 10 degrees", places[0], places[1]),
        difference(places[1], places[0]),
    );
    let shear = thirds(ten, |spot| spot.shear);
    report.decide("10 degrees: the shear is largest near the negative edge", told(shear), lead(shear, 0));
}

fn test_twenty(ten: &Measured, twenty: &Measured, report: &mut Report) {
    let shear = thirds(twenty, |spot| spot.shear);
    let least = shear.iter().copied().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or_default();
    report.decide(
        "20 degrees: no region without shear is left in the effective region",
        told(shear),
        Estimate { value: least.value - 0.02, error: least.error },
    );
    let normal = thirds(twenty, |spot| spot.normal);
    report.decide("20 degrees: the normal stress is largest at the positive edge", told(normal), lead(normal, 2));
    let centroid = |jet: &Measured| {
        let half = jet.jet.half_footprint();
        jet.derived(|spots| {
            let inside = || spots.iter().filter(|spot| spot.y.abs() < STRIP && spot.x.abs() < half);
            inside().map(|spot| spot.shear.abs() * spot.x / half).sum::<f64>()
                / inside().map(|spot| spot.shear.abs()).sum::<f64>()
        })
    };
    let centroids = [ten, twenty].map(centroid);
    report.decide(
        "20 degrees: the shear is concentrated at higher x/L than at 10 degrees (centroid of its magnitude, in halves of the footprint)",
        format!("{} at 10 degrees, {} at 20 degrees", centroids[0], centroids[1]),
        difference(centroids[1], centroids[0]),
    );
}

fn test_thirty(jet: &Measured, report: &mut Report) {
    let normal = thirds(jet, |spot| spot.normal);
    let change = difference(normal[1], normal[0]) * normal[1].value.recip();
    report.decide(
        format!("30 degrees: the normal stress is constant within {:.0} % but for the positive edge", 100.0 * CONSTANT),
        format!("it changes by {} % from the negative edge to the middle: {}", change * 100.0, told(normal)),
        nearness(change, 0.0, CONSTANT),
    );
    report.decide("30 degrees: it is largest at the positive edge", told(normal), lead(normal, 2));
    let shear = thirds(jet, |spot| spot.shear);
    let free = jet.jet.free().shear_over_pressure(STATIC, DYNAMIC) / DYNAMIC;
    let part = |of: usize| shear[of].value / normal[of].value;
    report.decide(
        "30 degrees: the shear is largest near the positive edge",
        format!(
            "{}; over the normal stress that is {:.2}, {:.2} and {:.2}, where grains that nothing deflects have {free:.2}",
            told(shear),
            part(0),
            part(1),
            part(2)
        ),
        lead(shear, 2),
    );
}

fn test_sixty(jet: &Measured, report: &mut Report) {
    for (what, of) in [("normal stress", (|spot| spot.normal) as fn(&Spot) -> f64), ("shear", |spot| spot.shear)] {
        let parts = thirds(jet, of);
        report.decide(format!("60 degrees: the {what} is largest near the positive edge"), told(parts), lead(parts, 2));
        let fall: Vec<(f64, Estimate)> = [(0.75, 0.95), (0.2, 0.6), (-0.6, -0.2), (-0.95, -0.75)]
            .map(|(from, to)| (-0.5 * (from + to), zone(jet, from, to, of)))
            .to_vec();
        report.claim_trend(
            format!("60 degrees: the {what} decays towards the negative edge (over -x, in halves of the footprint)"),
            &fall,
            Trend::Falls,
        );
    }
    let half = jet.jet.half_footprint();
    let unlike = jet.derived(|spots| {
        let inside = || spots.iter().filter(|spot| spot.y.abs() < STRIP && spot.x.abs() < half);
        inside().map(|spot| (spot.normal - spot.shear).abs()).sum::<f64>()
            / inside().map(|spot| spot.normal).sum::<f64>()
    });
    report.decide(
        "60 degrees: normal stress and shear have the same pattern within 5 %",
        format!("|N - S| is {} % of N on the footprint: nearly all hits slip", unlike * 100.0),
        Estimate { value: 0.05 - unlike.value, error: unlike.error },
    );
}

fn table(jets: &[Measured]) -> Table {
    let mut table = Table::new(
        "stress",
        &["angle", "x", "y", "normal", "normal_error", "shear", "shear_error", "across", "across_error"],
    );
    for jet in jets {
        let (pressure, width) = (jet.jet.free().pressure(), jet.length());
        let shear = DYNAMIC * pressure;
        for (index, patch) in jet.stress.patches().all().iter().enumerate() {
            let stress = jet.stress.stress(index);
            let [normal, along, across] =
                [stress.normal * pressure.recip(), stress.shear * shear.recip(), stress.across * shear.recip()];
            let [x, y] = [patch.centre.x / width, patch.centre.y / width];
            table.row(&[
                &jet.jet.angle,
                &x,
                &y,
                &normal.value,
                &normal.error,
                &along.value,
                &along.error,
                &across.value,
                &across.error,
            ]);
        }
    }
    table
}

/// Stresses along the strip in the middle.
fn charts(jets: &[Measured]) -> [Picture; 2] {
    let chart = |name, title: &str, of: fn(&Spot) -> f64, range: [f64; 2]| {
        let line = |(colour, jet): (usize, &Measured)| {
            let points = (0..32).map(|index| -2.0 + (f64::from(index) + 0.5) / 8.0);
            let at =
                |x: f64| jet.derived(|spots| mean(spots, |spot| spot.y.abs() < STRIP && (spot.x - x).abs() < 1e-6, of));
            Line::measured(format!("{} degrees", jet.jet.angle), colour, points.map(|x| (x, at(x))).collect())
        };
        Picture::Chart(Chart {
            name,
            title: title.into(),
            shows: format!("Circle of six diameters, volume fraction 0.1, 4 degrees of divergence; |y| < {STRIP} L"),
            x: Axis::linear("x / L (the jet flows to the left)", -2.0, 1.5),
            y: Axis::linear("stress over that of the non-interacting jet", range[0], range[1]),
            lines: jets.iter().enumerate().map(line).collect(),
        })
    };
    [
        chart("normal", "Normal stress under a circular nozzle", |spot| spot.normal, [0.0, 1.2]),
        chart("shear", "Shear under a circular nozzle, positive to the left", |spot| spot.shear, [-0.4, 1.2]),
    ]
}
