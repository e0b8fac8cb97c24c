//! Grains from a CSV table.
//!
//! The header names the columns, in any order: `x,y,z,vx,vy,vz` and, optionally, `wx,wy,wz,radius,density,strength`. A column `id`
//! is passed over, so that the `grains.csv` of one run can be the source of another. Lines that start with `#` are
//! comments.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use csv::{ErrorKind, ReaderBuilder, StringRecord, Trim};
use nalgebra::Vector3;
use rand_pcg::Pcg64Mcg;

use super::context::Context;
use super::radius::Radii;
use crate::grains::NewGrain;
use crate::scene::{FileSource, Invalid, LARGEST, SMALLEST};

/// All columns; the first `NEEDED` must be there.
const COLUMNS: [&str; 12] = ["x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "radius", "density", "strength"];
const NEEDED: usize = 6;
const RADIUS: usize = 9;
const DENSITY: usize = 10;
const STRENGTH: usize = 11;

/// Columns of what must be above 0.
const POSITIVE: [usize; 2] = [RADIUS, DENSITY];

/// Columns that must be 0 in a planar scene: y, vy, wx and wz.
const ZERO_IN_PLANE: [usize; 4] = [1, 4, 6, 8];

/// Reads the table of `source`, whose path starts from `folder`.
pub(super) fn read(source: &FileSource, folder: &Path, context: &Context<'_>) -> Result<Vec<NewGrain>, Invalid> {
    let path = folder.join(&source.path);
    let table = Table { path, key: context.key("path"), planar: context.planar() };
    let file = File::open(&table.path).map_err(|error| {
        table.invalid(
            format!("cannot be read: {error}"),
            "correct the path; it starts from the folder of the scene file",
        )
    })?;
    let mut reader = ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).from_reader(file);
    let columns = table.columns(reader.headers().map_err(|error| table.unreadable(&error, None))?)?;

    if columns[STRENGTH].is_some() && context.scene.near_field.is_none() {
        return Err(table.invalid(
            "has a column `strength`, but the scene has no near field",
            "take the column out, or add `[near_field]`",
        ));
    }

    let mut fallback = Fallback { rng: context.rng(), radii: None, density: None, strength: context.strength()? };
    if columns[RADIUS].is_none() {
        fallback.radii = Some(context.radii(source.radius.as_ref())?);
    }
    if columns[DENSITY].is_none() {
        fallback.density = Some(context.density(source.density)?);
    }
    let mut grains = Vec::new();
    for record in reader.into_records() {
        let row = grains.len();
        let record = record.map_err(|error| table.unreadable(&error, Some(row)))?;
        grains.push(table.grain(row, &record, &columns, &mut fallback)?);
    }
    if grains.is_empty() {
        return Err(table.invalid("has no rows", "add a row for each grain below the header"));
    }
    context.check_count("path", grains.len() as u128)?;
    Ok(grains)
}

/// The line on which row number `row` (from 0, below the header) of the table at `path` stands, blank lines and comments counted.
///
/// It is looked up when a message needs it, so that grains need not carry it. Rows of numbers do not go over several lines.
fn line_in(path: &Path, row: usize) -> Option<usize> {
    let lines = BufReader::new(File::open(path).ok()?).split(b'\n').map_while(Result::ok).zip(1..);
    let rows = lines.filter(|(line, _)| !matches!(line.as_slice(), [] | b"\r" | [b'#', ..]));
    Some(rows.skip(1).nth(row)?.1)
}

/// The line on which grain number `row` (from 0) of `source` stands.
pub(super) fn line_of(source: &FileSource, folder: &Path, row: usize) -> Option<usize> {
    line_in(&folder.join(&source.path), row)
}

/// Where each of `COLUMNS` stands in the table, if it does.
type Columns = [Option<usize>; COLUMNS.len()];

/// What a grain gets where the table has no such column.
struct Fallback {
    rng: Pcg64Mcg,
    radii: Option<Radii>,
    density: Option<f64>,
    strength: f64,
}

/// What messages say about the table.
struct Table {
    path: PathBuf,
    key: String,
    planar: bool,
}

impl Table {
    fn columns(&self, header: &StringRecord) -> Result<Columns, Invalid> {
        let mut columns = Columns::default();
        for (place, name) in header.iter().map(|name| name.trim_start_matches('\u{feff}')).enumerate() {
            match COLUMNS.iter().position(|column| *column == name) {
                Some(column) if columns[column].is_none() => columns[column] = Some(place),
                Some(_) => return Err(self.invalid(format!("has the column `{name}` twice"), "remove one of them")),
                None if name == "id" => {}
                None => {
                    let nearest = COLUMNS.into_iter().min_by_key(|column| strsim::damerau_levenshtein(column, name));
                    return Err(self.invalid(
                        format!(
                            "has a column `{name}` that means nothing; the nearest name is `{}`",
                            nearest.unwrap_or("x")
                        ),
                        format!("take it out or rename it; the columns are {}", COLUMNS.join(",")),
                    ));
                }
            }
        }
        let missing: Vec<&str> =
            (0..NEEDED).filter(|&column| columns[column].is_none()).map(|column| COLUMNS[column]).collect();
        if missing.is_empty() {
            Ok(columns)
        } else {
            Err(self.invalid(
                format!("lacks the columns {}", missing.join(",")),
                format!("let the first line name the columns {}", COLUMNS[..NEEDED].join(",")),
            ))
        }
    }

    fn grain(
        &self,
        row: usize,
        record: &StringRecord,
        columns: &Columns,
        fallback: &mut Fallback,
    ) -> Result<NewGrain, Invalid> {
        let value = |column: usize| columns[column].map(|place| self.number(row, column, &record[place])).transpose();
        let vector = |first: usize| -> Result<Vector3<f64>, Invalid> {
            let [x, y, z] = [value(first)?, value(first + 1)?, value(first + 2)?];
            Ok(Vector3::new(x.unwrap_or(0.0), y.unwrap_or(0.0), z.unwrap_or(0.0)))
        };
        let drawn = fallback.radii.as_ref().map(|radii| radii.draw(&mut fallback.rng));
        Ok(NewGrain {
            position: vector(0)?,
            velocity: vector(3)?,
            spin: vector(6)?,
            radius: value(RADIUS)?.or(drawn).expect("the radius has a column or a fallback"),
            density: value(DENSITY)?.or(fallback.density).expect("the density has a column or a fallback"),
            strength: value(STRENGTH)?.unwrap_or(fallback.strength),
        })
    }

    fn number(&self, row: usize, column: usize, text: &str) -> Result<f64, Invalid> {
        let refuse = |what: &str, remedy: &str| {
            let shown: String = text.chars().take(40).collect();
            Err(self.invalid(format!("{}column `{}`: `{shown}` {what}", self.line(Some(row)), COLUMNS[column]), remedy))
        };
        match text.parse::<f64>() {
            Err(_) => refuse("is not a number", "write a number such as 0.25 or -1.5e-3"),
            Ok(value) if !value.is_finite() => refuse("is not finite", "give a finite number"),
            Ok(value) if value.abs() > LARGEST => refuse("is too large to compute with", "give it in SI units"),
            Ok(value) if POSITIVE.contains(&column) && value > 0.0 && value < SMALLEST => {
                refuse("is too small to compute with", "give it in SI units")
            }
            Ok(value) if POSITIVE.contains(&column) && value <= 0.0 => {
                refuse("is not larger than 0", "give a number larger than 0")
            }
            Ok(value) if self.planar && ZERO_IN_PLANE.contains(&column) && value != 0.0 => refuse(
                "is not 0, but the scene is planar",
                "set it to 0, or `planar = false`: grains of a planar scene stay in the plane y = 0",
            ),
            // A planar scene has y = 0 exactly, and not -0.
            Ok(value) => Ok(value + 0.0),
        }
    }

    /// What a message about a row begins with; of the header when there is no row yet.
    fn line(&self, row: Option<usize>) -> String {
        row.and_then(|row| line_in(&self.path, row)).map_or_else(String::new, |line| format!("line {line}: "))
    }

    fn unreadable(&self, error: &csv::Error, row: Option<usize>) -> Invalid {
        let line = self.line(row);
        match error.kind() {
            ErrorKind::UnequalLengths { expected_len, len, .. } => self.invalid(
                format!("{line}{len} values, but the header has {expected_len} columns"),
                "give every row one value for each column",
            ),
            ErrorKind::Utf8 { .. } => {
                self.invalid(format!("{line}not text in UTF-8"), "save the table as plain text in UTF-8")
            }
            _ => self.invalid(format!("{line}cannot be read: {error}"), "check that it is a CSV table"),
        }
    }

    fn invalid(&self, what: impl AsRef<str>, remedy: impl Into<String>) -> Invalid {
        Invalid::new(&self.key, format!("{}: {}", self.path.display(), what.as_ref()), remedy)
    }
}
