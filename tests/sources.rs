//! Sources that fill the scene at the start: block, lattice and file.

use std::fmt::Write as _;
use std::path::Path;

use approx::assert_relative_eq;
use impinge::grains::NewGrain;
use impinge::scene::{Invalid, Scene};
use impinge::source::{Placed, place};
use nalgebra::Vector3;

const ROOM: &str = "min = [-5.0, -5.0, -5.0], max = [5.0, 5.0, 5.0]";

fn scene(domain: &str, sources: &str) -> Scene {
    let text =
        format!("run.until = 1.0\ndomain = {{ {domain} }}\ngrain = {{ radius = 0.01, density = 2500.0 }}\n{sources}");
    toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"))
}

fn placed(scene: &Scene) -> Result<Placed, Invalid> {
    place(scene, Path::new("."), &|_, _| None)
}

fn grains(domain: &str, sources: &str) -> Vec<NewGrain> {
    placed(&scene(domain, sources)).unwrap_or_else(|error| panic!("{error}")).grains
}

fn refusal(domain: &str, sources: &str) -> Invalid {
    placed(&scene(domain, sources)).expect_err("this must be refused")
}

fn block(count: u64, min: [f64; 3], max: [f64; 3], more: &str) -> String {
    format!(
        "[[source]]\nkind = \"block\"\ncount = {count}\nvelocity = [0.0, 0.0, -1.0]\nmin = {min:?}\nmax = {max:?}\n{more}\n"
    )
}

fn lattice(cells: [u32; 3], max: [f64; 3], more: &str) -> String {
    format!(
        "[[source]]\nkind = \"lattice\"\ncells = {cells:?}\nvelocity = [1.0, 0.0, 0.0]\nmin = [0.0, 0.0, 0.0]\nmax = {max:?}\n{more}\n"
    )
}

/// The least gap between any two grains over their mean radius; `period` is 0 where the domain is open.
fn least_gap(grains: &[NewGrain], period: [f64; 3]) -> f64 {
    let mut least = f64::INFINITY;
    for (number, a) in grains.iter().enumerate() {
        for b in &grains[..number] {
            let offset = (a.position - b.position)
                .zip_map(&period.into(), |d, period| if period > 0.0 { d - period * (d / period).round() } else { d });
            let reach = a.radius + b.radius;
            least = least.min((offset.norm() - reach) / (0.5 * reach));
        }
    }
    least
}

/// What a table read from `text` gives.
fn from_table(domain: &str, text: &str) -> Result<Vec<NewGrain>, Invalid> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grains.csv"), text).unwrap();
    let scene = scene(domain, "[[source]]\nkind = \"file\"\npath = \"grains.csv\"");
    place(&scene, folder.path(), &|_, _| None).map(|placed| placed.grains)
}

// Blocks

#[test]
fn ten_thousand_grains_of_mukherjee_and_zohdi_fit_with_centres_in_the_box() {
    let grains = grains(ROOM, &block(10_000, [0.0; 3], [2.5, 0.2, 0.2], ""));
    assert_eq!(grains.len(), 10_000);
    for grain in &grains {
        assert!((0..3).all(|axis| (0.0..=[2.5, 0.2, 0.2][axis]).contains(&grain.position[axis])));
    }
    assert!(least_gap(&grains, [0.0; 3]) >= -1e-15);
}

#[test]
fn a_block_that_is_too_full_says_how_much_fits() {
    // 8472 to 8512 spheres inside the walls in the table of the equations' notes, four seeds of this code 8449 to 8548.
    let sources = block(10_000, [0.0; 3], [2.5, 0.2, 0.2], "inside = \"grains\"");
    let refusal = refusal(ROOM, &sources);
    assert_eq!(refusal.key, "source[0].count");
    let words: Vec<&str> = refusal.what.split(' ').collect();
    let count: f64 = words[1].parse().unwrap();
    assert!((8400.0..8600.0).contains(&count), "{}", refusal.what);
    assert!(
        refusal.what.contains("of 10000 grains fit") && refusal.what.contains("fraction of 0.35"),
        "{}",
        refusal.what
    );
    assert!(refusal.remedy.contains(&format!("at most {count}")), "{}", refusal.remedy);
}

/// How many grains saturate the scene, from the message that says so.
fn saturation(domain: &str, sources: &str, seed: u64) -> f64 {
    let mut scene = scene(domain, sources);
    scene.seed = seed;
    placed(&scene).unwrap_err().what.split(' ').nth(1).unwrap().parse().unwrap()
}

fn mean_saturation(domain: &str, sources: &str) -> f64 {
    const SEEDS: u64 = 8;
    (0..SEEDS).map(|seed| saturation(domain, sources, seed)).sum::<f64>() / SEEDS as f64
}

#[test]
fn saturation_in_three_dimensions_is_that_of_the_literature() {
    let domain = "min = [0.0, 0.0, 0.0], max = [0.2, 0.2, 0.2], boundary = \"periodic\"";
    let count = mean_saturation(domain, &block(800, [0.0; 3], [0.2; 3], ""));
    let fraction = count * impinge::grains::sphere_volume(0.01) / 0.008;
    // 0.3841 (Zhang & Torquato 2013); the standard deviation of this mean is 0.001.
    assert!((fraction - 0.3841).abs() < 0.005, "{fraction}");
}

#[test]
fn saturation_in_two_dimensions_is_that_of_the_literature() {
    let domain = "min = [0.0, 0.0, 0.0], max = [0.8, 0.0, 0.8], boundary = \"periodic\", planar = true";
    let count = mean_saturation(domain, &block(1200, [0.0; 3], [0.8, 0.0, 0.8], ""));
    let fraction = count * std::f64::consts::PI * 1e-4 / 0.64;
    // 0.5471 (Feder 1980; Zhang & Torquato 2013); the standard deviation of this mean is 0.001.
    assert!((fraction - 0.5471).abs() < 0.005, "{fraction}");
}

#[test]
fn saturation_in_one_dimension_is_renyis_parking_constant() {
    // A box without width: centres on a line 5000 diameters long, that is a street of length x = 5001 cars.
    let domain = "min = [-1.0, -1.0, -1.0], max = [101.0, 1.0, 1.0]";
    let count = mean_saturation(domain, &block(5001, [0.0; 3], [100.0, 0.0, 0.0], ""));
    // Rényi (1958): C (x + 1) - 1; variance 0.03816 x, hence a standard deviation of 4.9 of the mean of eight.
    let expected = 0.747_597_9 * 5002.0 - 1.0;
    assert!((count - expected).abs() < 20.0, "{count} instead of {expected}");
}

#[test]
fn places_are_drawn_evenly_from_what_is_free() {
    // On a line from 0 to 1 a grain in the middle leaves 0..0.4 and 0.6..1 to the centre of another.
    let table = "[[source]]\nkind = \"lattice\"\nmin = [0.0, -1.0, -1.0]\nmax = [1.0, 1.0, 1.0]\ncells = [1, 1, 1]\n\
                 velocity = [0.0, 0.0, 0.0]\nradius = 0.05";
    let sources = format!("{table}\n{}", block(1, [0.0; 3], [1.0, 0.0, 0.0], "radius = 0.05"));
    let mut scene = scene(ROOM, &sources);
    let mut ranks: Vec<f64> = (0..4000)
        .map(|seed| {
            scene.seed = seed;
            let x = placed(&scene).unwrap().grains[1].position.x;
            assert!((0.0..=0.4).contains(&x) || (0.6..=1.0).contains(&x), "{x}");
            (if x < 0.5 { x } else { x - 0.2 }) / 0.8
        })
        .collect();
    ranks.sort_by(f64::total_cmp);
    let distance = ranks.iter().enumerate().map(|(i, x)| (x - (i as f64 + 0.5) / 4000.0).abs()).fold(0.0, f64::max);
    // Kolmogorov-Smirnov at 0.1 %: 1.95 / sqrt(n).
    assert!(distance < 1.95 / 4000f64.sqrt(), "{distance}");
}

#[test]
fn a_dilute_block_is_uniform() {
    let grains = grains(ROOM, &block(20_000, [-1.0; 3], [1.0; 3], "radius = 0.001"));
    let mut counts = [0.0; 64];
    for grain in &grains {
        let cell = grain.position.map(|x| ((x + 1.0) * 2.0) as usize);
        counts[16 * cell.x + 4 * cell.y + cell.z] += 1.0;
    }
    let expected = 20_000.0 / 64.0;
    let chi_square: f64 = counts.iter().map(|count: &f64| (count - expected).powi(2) / expected).sum();
    // 63 degrees of freedom: 99.9 % lie below 103.4.
    assert!(chi_square < 103.4, "{chi_square}");
}

#[test]
fn periodic_blocks_keep_clear_of_images() {
    let domain = "min = [0.0, 0.0, 0.0], max = [0.2, 0.1, 0.15], boundary = \"periodic\"";
    let grains = grains(domain, &block(240, [0.0; 3], [0.2, 0.1, 0.15], ""));
    assert!(least_gap(&grains, [0.2, 0.1, 0.15]) >= -1e-15);
}

#[test]
fn drawn_radii_keep_their_distribution_however_full_the_box() {
    for distribution in ["uniform", "normal", "lognormal"] {
        let radius =
            format!("inside = \"grains\"\nradius = {{ mean = 0.01, cv = 0.3, distribution = \"{distribution}\" }}");
        let grains = grains(ROOM, &block(2000, [0.0; 3], [0.5, 0.4, 0.2], &radius));
        assert!(least_gap(&grains, [0.0; 3]) >= -1e-15);
        let inside = |grain: &NewGrain| {
            (0..3).all(|axis| {
                grain.position[axis] - grain.radius >= -1e-15
                    && grain.position[axis] + grain.radius <= [0.5, 0.4, 0.2][axis] + 1e-15
            })
        };
        assert!(grains.iter().all(inside));
        let mean = |half: &[NewGrain]| half.iter().map(|grain| grain.radius).sum::<f64>() / half.len() as f64;
        // 0.3 / sqrt(2000) is 0.7 %; ids say nothing about size, so both halves have the mean.
        assert_relative_eq!(mean(&grains), 0.01, max_relative = 0.03);
        assert_relative_eq!(mean(&grains[..1000]), mean(&grains[1000..]), max_relative = 0.05);
    }
}

#[test]
fn small_grains_find_the_room_that_large_ones_leave() {
    // Equal radii saturate this box at 0.36; with dust between them it takes more.
    let dust = "inside = \"grains\"\nradius = { mean = 0.01, cv = 0.56, distribution = \"uniform\" }";
    let grains = grains(ROOM, &block(390, [0.0; 3], [0.25, 0.2, 0.15], dust));
    let solid: f64 = grains.iter().map(|grain| impinge::grains::sphere_volume(grain.radius)).sum();
    assert!(solid / 0.0075 > 0.4, "{}", solid / 0.0075);
    assert!(least_gap(&grains, [0.0; 3]) >= -1e-15);
}

#[test]
fn a_block_keeps_clear_of_earlier_sources() {
    let sources = lattice([5, 5, 5], [0.2; 3], "")
        + &block(200, [0.0; 3], [0.2; 3], "radius = 0.005")
        + &block(50, [0.0; 3], [0.2; 3], "");
    let placed = placed(&scene(ROOM, &sources)).unwrap();
    assert_eq!(placed.counts, [125, 200, 50]);
    assert!(least_gap(&placed.grains, [0.0; 3]) >= -1e-15);
}

#[test]
fn same_seed_same_grains_and_another_source_changes_no_draw() {
    let one = block(100, [0.0; 3], [1.0; 3], "thermal_speed = 1.0");
    let two = block(100, [0.0, 0.0, 2.0], [1.0, 1.0, 3.0], "thermal_speed = 1.0");
    let both = grains(ROOM, &(one.clone() + &two));
    assert_eq!(grains(ROOM, &(one.clone() + &two)), both);
    assert_eq!(grains(ROOM, &one)[..], both[..100]);
    assert_ne!(both[0].velocity, both[100].velocity);
    let mut other = scene(ROOM, &one);
    other.seed = 2;
    assert_ne!(placed(&other).unwrap().grains, both[..100]);
}

#[test]
fn thermal_velocities_are_maxwellian() {
    let grains = grains(ROOM, &block(20_000, [-2.0; 3], [2.0; 3], "thermal_speed = 0.5"));
    for axis in 0..3 {
        let shift = [0.0, 0.0, -1.0][axis];
        let moment =
            |power| grains.iter().map(|grain| (grain.velocity[axis] - shift).powi(power)).sum::<f64>() / 20_000.0;
        assert!(moment(1).abs() < 0.015);
        assert_relative_eq!(moment(2), 0.25, max_relative = 0.04);
        assert_relative_eq!(moment(4), 3.0 * 0.0625, max_relative = 0.12);
    }
}

#[test]
fn planar_scenes_stay_in_the_plane_exactly() {
    let domain = "min = [0.0, 7.0, 0.0], max = [1.0, -3.0, 1.0], planar = true";
    let spin = "spin = [0.0, 5.0, 0.0]\nthermal_speed = 0.3";
    let sources = block(800, [0.0, 9.0, 0.5], [1.0, -9.0, 1.0], spin)
        + &lattice([20, 1, 10], [1.0, 0.0, 0.45], "arrangement = \"face-centred\"\nthermal_speed = 0.2");
    let grains = grains(domain, &sources);
    assert_eq!(grains.len(), 800 + 400);
    let zero = 0f64.to_bits();
    assert!(grains.iter().all(|grain| grain.position.y.to_bits() == zero && grain.velocity.y == 0.0));
    assert!(grains.iter().all(|grain| grain.velocity.x != 0.0 && grain.velocity.z != 0.0));
    assert!(least_gap(&grains, [0.0; 3]) >= -1e-15);
}

#[test]
fn absurd_counts_are_refused_at_once() {
    let refusal_of = |count, more: &str| refusal(ROOM, &block(count, [-1.0; 3], [1.0; 3], more));
    let refused = refusal_of(1_000_000_000_000, "");
    assert_eq!(refused.key, "source[0].count");
    assert!(refused.what.contains("1000000000000 grains cannot fit"), "{}", refused.what);
    let refused = refusal_of(1_000_000_000_000, "radius = 1e-6");
    assert!(refused.what.contains("600000 GB"), "{}", refused.what);
    let refused = refusal_of(u64::MAX >> 1, "radius = { mean = 1e-3, cv = 0.5, distribution = \"lognormal\" }");
    assert_eq!(refused.key, "source[0].count");
    // Just beyond the densest packing, π/√18 of the box and the radius around it.
    assert!(refusal_of(1_500_000, "").what.contains("densest packing"));
    // Below it, but a random block would take minutes to prove that it is full.
    assert!(refusal_of(1_000_000, "").what.contains("volume fraction of 0.508"), "{}", refusal_of(1_000_000, "").what);
    assert_eq!(refusal_of(0, "").what, "no grains");
    let line = refusal(ROOM, &block(3, [0.0; 3], [0.015, 1.0, 1.0], "inside = \"grains\""));
    assert_eq!(line.key, "source[0].max");
    assert!(line.what.contains("0.015 wide along x"), "{}", line.what);
}

#[test]
fn a_box_without_any_extent_holds_one_grain() {
    assert_eq!(grains(ROOM, &block(1, [0.5; 3], [0.5; 3], ""))[0].position, Vector3::repeat(0.5));
    assert!(refusal(ROOM, &block(2, [0.5; 3], [0.5; 3], "")).what.contains("cannot fit"));
}

#[test]
fn a_hole_of_size_zero_ends_the_search() {
    // Eight grains of a cubic lattice leave a hole at the middle of the box where a ninth fits with gap 0 only.
    let radius = 0.5 * (3f64.sqrt() * 0.2 - 2.0 * 0.1) + 0.05;
    let sources = lattice([2, 2, 2], [0.4; 3], "radius = 0.1")
        + &block(1, [0.1; 3], [0.3; 3], &format!("radius = {}", radius.min(3f64.sqrt() * 0.1 - 0.1)));
    assert!(refusal(ROOM, &sources).what.starts_with("only 0 of 1"));
}

// Lattices

#[test]
fn lattices_fill_their_box_evenly() {
    let cubic = grains(ROOM, &lattice([4, 3, 2], [0.4, 0.3, 0.2], ""));
    assert_eq!(cubic.len(), 24);
    assert_relative_eq!(cubic[0].position, Vector3::repeat(0.05), epsilon = 1e-15);
    assert_relative_eq!(cubic[1].position, Vector3::new(0.15, 0.05, 0.05), epsilon = 1e-15);
    assert_relative_eq!(cubic[23].position, Vector3::new(0.35, 0.25, 0.15), epsilon = 1e-15);
    let face_centred = grains(ROOM, &lattice([3, 3, 3], [0.3; 3], "arrangement = \"face-centred\""));
    assert_eq!(face_centred.len(), 108);
    let mean = face_centred.iter().map(|grain| grain.position).sum::<Vector3<f64>>() / 108.0;
    assert_relative_eq!(mean, Vector3::repeat(0.15), epsilon = 1e-14);
    assert_relative_eq!(least_gap(&face_centred, [0.0; 3]), 0.1 / 2f64.sqrt() / 0.01 - 2.0, epsilon = 1e-12);
}

#[test]
fn a_lattice_of_touching_grains_is_allowed_and_a_tighter_one_is_not() {
    for (arrangement, largest) in [("cubic", 0.05), ("face-centred", 0.1 / 8f64.sqrt())] {
        let with =
            |radius: f64| lattice([5, 5, 5], [0.5; 3], &format!("arrangement = \"{arrangement}\"\nradius = {radius}"));
        for domain in [ROOM, "min = [0.0, 0.0, 0.0], max = [0.5, 0.5, 0.5], boundary = \"periodic\""] {
            assert!(!grains(domain, &with(largest)).is_empty());
            let refused = refusal(domain, &with(largest + 1e-6));
            assert!(refused.what.contains("overlap by 2.000e-6 m"), "{}", refused.what);
            let said: f64 = refused.remedy.split([' ', ';']).nth(8).unwrap().parse().unwrap();
            assert_relative_eq!(said, largest, max_relative = 1e-12);
        }
    }
    assert_eq!(refusal(ROOM, &lattice([100_000; 3], [0.3; 3], "")).key, "source[0].cells");
    assert_eq!(refusal(ROOM, &lattice([3, 0, 3], [0.3; 3], "")).what, "no grains");
}

// Files

#[test]
fn tables_are_read_in_any_order_of_columns() {
    let text = "id, vz,radius,z,y,x,vx,vy\n# a comment\n7,-80,0.5,3,2,1,0.1,1e-3\n\n8,-81,0.25,-3,-2,-1,0,0\n";
    let grains = from_table(ROOM, text).unwrap();
    assert_eq!(grains.len(), 2);
    assert_eq!(grains[0].position, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(grains[0].velocity, Vector3::new(0.1, 1e-3, -80.0));
    assert_eq!((grains[0].radius, grains[0].density, grains[0].spin), (0.5, 2500.0, Vector3::zeros()));
    assert_eq!(grains[1].radius, 0.25);
    let spun =
        from_table(ROOM, "\u{feff}x,y,z,vx,vy,vz,wx,wy,wz,radius,density\n0,0,0,0,0,0,1,2,3,0.1,8500\n").unwrap();
    assert_eq!((spun[0].spin, spun[0].density), (Vector3::new(1.0, 2.0, 3.0), 8500.0));
}

#[test]
fn strengths_come_with_the_grains_and_are_1_where_nothing_is_said() {
    const NEAR_FIELD: &str = "[near_field]\nalpha1 = 1.0\nbeta1 = 2\nalpha2 = 0.0\nbeta2 = 3\n";
    let folder = tempfile::tempdir().unwrap();
    let head = "x,y,z,vx,vy,vz";
    std::fs::write(folder.path().join("plain.csv"), format!("{head}\n1,0,0,0,0,0\n")).unwrap();
    std::fs::write(folder.path().join("own.csv"), format!("{head},strength\n2,0,0,0,0,0,-2\n3,0,0,0,0,0,0\n")).unwrap();
    let table = |name: &str| format!("[[source]]\nkind = \"file\"\npath = \"{name}.csv\"\nstrength = 7.0\n");
    let sources = [
        NEAR_FIELD.to_owned(),
        block(1, [-1.0; 3], [-1.0; 3], "strength = 0.5"),
        lattice([1, 1, 1], [0.5; 3], ""),
        table("plain"),
        table("own"),
    ];
    let placed = place(&scene(ROOM, &sources.concat()), folder.path(), &|_, _| None).unwrap_or_else(|e| panic!("{e}"));
    let strengths: Vec<f64> = placed.grains.iter().map(|grain| grain.strength).collect();
    assert_eq!(strengths, [0.5, 1.0, 7.0, -2.0, 0.0]);

    let nozzle = "[[source]]\nkind = \"nozzle\"\nshape.circle.diameter = 1.0\ncentre = [0, 0, 0]\naxis = [0, 0, -1]\nspeed = 1\n\
        flow.number_flux = 10\nstrength = 3.0\n";
    let mut placed = place(&scene(ROOM, &format!("{NEAR_FIELD}{nozzle}")), folder.path(), &|_, _| None)
        .unwrap_or_else(|e| panic!("{e}"));
    let nozzle = &mut placed.nozzles[0];
    let due = nozzle.due().expect("it never stops");
    assert_eq!(nozzle.enter(due, &mut |_, _| true).expect("the place is free").strength, 3.0);
}

#[test]
fn numbers_of_a_table_round_trip() {
    let x = [0.1 + 0.2, 1.0 / 3.0, -1e-300];
    let grains = from_table(ROOM, &format!("x,y,z,vx,vy,vz\n{},{},{},0,0,0\n", x[0], x[1], x[2])).unwrap();
    assert_eq!(grains[0].position, Vector3::from(x));
}

#[test]
fn bad_tables_are_refused_with_line_column_and_value() {
    let planar = "min = [-5.0, -5.0, -5.0], max = [5.0, 5.0, 5.0], planar = true";
    for (domain, text, message) in [
        (ROOM, "", "lacks the columns x,y,z,vx,vy,vz"),
        (ROOM, "x,y,z,vx,vy,vz\n", "has no rows"),
        (ROOM, "x,y,z,vx,vz\n1,2,3,4,5\n", "lacks the columns vy"),
        (ROOM, "x,y,z,vx,vy,vz,raduis\n1,2,3,4,5,6,7\n", "`raduis` that means nothing; the nearest name is `radius`"),
        (ROOM, "x,y,z,vx,vy,vz,x\n1,2,3,4,5,6,7\n", "has the column `x` twice"),
        (ROOM, "x,y,z,vx,vy,vz\n0,0,0,0,0,0\n1,2,3,4,5,six\n", "line 3: column `vz`: `six` is not a number"),
        (ROOM, "x,y,z,vx,vy,vz\n0,0,NaN,0,0,0\n", "line 2: column `z`: `NaN` is not finite"),
        (ROOM, "x,y,z,vx,vy,vz\n0,0,1e999,0,0,0\n", "line 2: column `z`: `1e999` is not finite"),
        (ROOM, "x,y,z,vx,vy,vz,radius\n0,0,0,0,0,0,-0.1\n", "line 2: column `radius`: `-0.1` is not larger than 0"),
        (ROOM, "x,y,z,vx,vy,vz,density\n0,0,0,0,0,0,0\n", "line 2: column `density`: `0` is not larger than 0"),
        (ROOM, "# mm\nx,y,z,vx,vy,vz\n\n0,0,0,0,0,0\n\r\n# last\n1,2,3,4,5,six", "line 7: column `vz`: `six` is not a"),
        (ROOM, "x,y,z,vx,vy,vz\n0,0,0,0,0\n", "line 2: 5 values, but the header has 6 columns"),
        (planar, "x,y,z,vx,vy,vz\n0,0.1,0,0,0,0\n", "line 2: column `y`: `0.1` is not 0, but the scene is planar"),
        (planar, "x,y,z,vx,vy,vz\n0,0,0,0,-1,0\n", "line 2: column `vy`: `-1` is not 0, but the scene is planar"),
    ] {
        let refused = from_table(domain, text).unwrap_err();
        assert_eq!(refused.key, "source[0].path");
        assert!(refused.what.contains("grains.csv") && refused.what.contains(message), "{message}\n{}", refused.what);
        assert!(!refused.remedy.is_empty());
    }
    let missing = refusal(ROOM, "[[source]]\nkind = \"file\"\npath = \"nowhere.csv\"");
    assert!(missing.what.contains("nowhere.csv: cannot be read"), "{}", missing.what);
}

// Overlaps and the domain

fn table(rows: &[[f64; 3]]) -> String {
    rows.iter().fold("x,y,z,vx,vy,vz\n".to_string(), |mut text, [x, y, z]| {
        writeln!(text, "{x},{y},{z},0,0,0").unwrap();
        text
    })
}

#[test]
fn newtons_cradle_touches_and_is_accepted() {
    let rows: Vec<[f64; 3]> = (0..50).map(|i| [0.7 + 0.02 * f64::from(i), 1.0 / 3.0, 0.1]).collect();
    assert_eq!(from_table(ROOM, &table(&rows)).unwrap().len(), 50);
}

#[test]
fn overlapping_grains_are_named_with_their_depth() {
    let refused = from_table(ROOM, &table(&[[0.0; 3], [1.0; 3], [1.0, 1.0, 1.019]])).unwrap_err();
    assert_eq!(refused.key, "source[0].path");
    let expected = "grain 1 (grains.csv, line 3) and grain 2 (grains.csv, line 4) overlap by 1.000e-3 m";
    assert!(refused.what.contains(expected), "{}", refused.what);

    let across = block(10, [0.0; 3], [0.1; 3], "") + &lattice([5, 5, 5], [0.1; 3], "");
    let refused = refusal(ROOM, &across);
    assert_eq!(refused.key, "source[1]");
    assert!(
        refused.what.contains(" of source[0] and grain ") && refused.what.contains(" of source[1] overlap by "),
        "{}",
        refused.what
    );
    assert_eq!(refused.remedy, "put source[0] behind source[1]: a block keeps clear of the sources before it");
}

#[test]
fn overlaps_with_periodic_images_are_found() {
    let periodic = "min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 0.09], boundary = \"periodic\"";
    let rows = [[0.001, 0.5, 0.01], [0.99, 0.5, 0.01]];
    assert!(from_table(periodic, &table(&rows)).unwrap_err().what.contains("overlap by 9.000e-3 m"));
    assert!(from_table("min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 0.09]", &table(&rows)).is_ok());
}

/// The largest radius counts, of whatever source and however it came about.
#[test]
fn a_periodic_domain_is_eight_radii_wide() {
    let domain = |side: f64| format!("min = [0.0, 0.0, 0.0], max = [1.0, 1.0, {side}], boundary = \"periodic\"");
    let radius =
        |radius: f64| format!("x,y,z,vx,vy,vz,radius\n0.2,0.2,0.01,0,0,0,0.001\n0.5,0.5,0.05,0,0,0,{radius}\n");
    assert!(from_table(&domain(0.0801), &radius(0.01)).is_ok());
    let nozzle = |radius: &str| {
        format!(
            "[[source]]\nkind = \"nozzle\"\nshape = {{ circle = {{ diameter = 0.04 }} }}\ncentre = [0.5, 0.5, 0.04]\n\
             axis = [1, 0, 0]\nspeed = 1.0\nflow = {{ number_flux = 1.0 }}\nradius = {radius}\n"
        )
    };
    let drawn = "{ mean = 0.01, cv = 0.1, distribution = \"uniform\" }";
    for refused in [
        from_table(&domain(0.0799), &radius(0.01)).unwrap_err(),
        refusal(&domain(0.0801), &nozzle(drawn)),
        refusal(&domain(0.0801), &block(1, [0.0; 3], [0.05; 3], &format!("radius = {drawn}"))),
    ] {
        assert_eq!(refused.key, "domain.max[2]");
        assert!(refused.what.contains("too narrow for grains of radius"), "{}", refused.what);
    }
    assert_eq!(refusal(&domain(0.5), &nozzle(&drawn.replace("uniform", "lognormal"))).key, "source[0].radius");
}

#[test]
fn grains_outside_the_domain_or_in_the_surface_are_refused() {
    let refused =
        from_table("min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0]", &table(&[[0.5; 3], [0.5, 0.5, 1.5]])).unwrap_err();
    let expected = "grain 1 (grains.csv, line 3) at (0.5, 0.5, 1.5), radius 0.01 m, has its centre outside the domain";
    assert!(refused.what.contains(expected), "{}", refused.what);
    let plane = |position: Vector3<f64>, radius: f64| (position.z < radius).then_some((3, radius - position.z));
    let at = |z: f64| place(&scene(ROOM, &block(1, [0.0, 0.0, z], [0.0, 0.0, z], "")), Path::new("."), &plane);
    assert!(at(0.01 - 1e-16).is_ok(), "a grain that rests on the surface touches it");
    let refused = at(0.008).unwrap_err();
    assert!(refused.what.contains("overlaps surface[3] by 2.000e-3 m"), "{}", refused.what);
}

#[test]
fn every_value_of_a_source_is_checked() {
    let planar = "min = [-5.0, -5.0, -5.0], max = [5.0, 5.0, 5.0], planar = true";
    let ok = |more: &str| block(1, [0.0; 3], [1.0; 3], more);
    for (domain, sources, key, value) in [
        (ROOM, ok("radius = -0.1"), "source[0].radius", "-0.1"),
        (ROOM, ok("radius = { mean = 0.1, cv = 0.5, distribution = \"normal\" }"), "source[0].radius.cv", "0.5"),
        (ROOM, ok("density = 0.0"), "source[0].density", "0"),
        (ROOM, ok("density = nan"), "source[0].density", "NaN"),
        (ROOM, ok("thermal_speed = -1.0"), "source[0].thermal_speed", "-1"),
        (ROOM, ok("spin = [0.0, inf, 0.0]"), "source[0].spin", "inf"),
        (ROOM, block(1, [0.0; 3], [1.0, -2.0, 1.0], ""), "source[0].max", "its y is -2"),
        (ROOM, block(1, [0.0; 3], [1.0, 1.0, 6.0], ""), "source[0].max", "its z is 6, outside the domain"),
        (ROOM, block(1, [-7.0, 0.0, 0.0], [1.0; 3], ""), "source[0].min", "its x is -7, outside the domain"),
        (ROOM, ok("").replace("velocity = [0.0", "velocity = [nan"), "source[0].velocity", "NaN"),
        (ROOM, lattice([1, 1, 1], [1.0; 3], "radius = 0.0"), "source[0].radius", "0"),
        (planar, ok("spin = [1.0, 0.0, 0.0]"), "source[0].spin", "its x is 1"),
        (planar, ok("").replace("[0.0, 0.0, -1.0]", "[0.0, 2.0, -1.0]"), "source[0].velocity", "its y is 2"),
        (planar, lattice([1, 2, 1], [1.0; 3], ""), "source[0].cells", "2 cells along y"),
    ] {
        let refused = refusal(domain, &sources);
        assert_eq!(refused.key, key, "{}", refused.what);
        assert!(refused.what.contains(value), "{key}: {}", refused.what);
        assert!(!refused.remedy.is_empty());
    }
    let mut kind = scene(ROOM, &ok(""));
    kind.grain.density = -1.0;
    assert_eq!(placed(&kind).unwrap_err().key, "grain.density");
}
