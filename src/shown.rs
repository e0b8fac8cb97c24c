//! What is shown of a result: tables and pictures, as data. `output/` writes and draws them.

use std::fmt::Display;

use crate::estimate::Estimate;

/// Numbers in rows.
#[derive(Clone, Debug)]
pub struct Table {
    /// Name of its file, without ending.
    pub name: &'static str,
    /// What the columns are called.
    pub columns: &'static [&'static str],
    /// The cells, as they are written: numbers with as many digits as read back the same.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    #[must_use]
    pub fn new(name: &'static str, columns: &'static [&'static str]) -> Self {
        Self { name, columns, rows: Vec::new() }
    }

    /// Adds a row: a cell for each column.
    ///
    /// # Panics
    /// If there are more or fewer cells than columns.
    pub fn row(&mut self, cells: &[&dyn Display]) {
        assert_eq!(cells.len(), self.columns.len(), "a row of {}", self.name);
        self.rows.push(cells.iter().map(|cell| cell.to_string()).collect());
    }
}

/// A picture, as data.
#[derive(Clone, Debug)]
pub enum Picture {
    /// Lines and points over an axis.
    Chart(Chart),
    /// Colours over a plane.
    Map(Map),
}

impl Picture {
    /// Name of its file, without ending.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Chart(chart) => chart.name,
            Self::Map(map) => map.name,
        }
    }
}

impl Picture {
    /// What stands over it.
    #[must_use]
    pub fn title(&self) -> &str {
        match self {
            Self::Chart(chart) => &chart.title,
            Self::Map(map) => &map.title,
        }
    }
}

/// How numbers are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithms: they must be positive.
    Log,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: String,
    /// How it is laid out.
    pub scale: Scale,
    /// From where to where.
    pub range: [f64; 2],
    /// Whether it is a length: a map over two lengths in the same unit is drawn to scale.
    pub is_length: bool,
}

impl Axis {
    /// An evenly divided axis.
    #[must_use]
    pub fn linear(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self { label: label.into(), scale: Scale::Linear, range: [low, high], is_length: false }
    }

    /// An evenly divided axis that shows a length, in the unit of the other axis.
    #[must_use]
    pub fn length(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self { is_length: true, ..Self::linear(label, low, high) }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self { label: label.into(), scale: Scale::Log, range: [low, high], is_length: false }
    }
}

/// Lines and points over an axis.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Name of its file, without ending.
    pub name: &'static str,
    /// What stands over it.
    pub title: String,
    /// What it shows, in a line below that.
    pub shows: String,
    /// Left to right.
    pub x: Axis,
    /// Bottom to top.
    pub y: Axis,
    /// What is drawn.
    pub lines: Vec<Line>,
}

/// One line of a chart.
#[derive(Clone, Debug)]
pub struct Line {
    /// What the key calls it; one without a name is not in the key.
    pub name: String,
    /// Places x and values with their standard errors (0: no bar).
    pub points: Vec<(f64, Estimate)>,
    /// How it is drawn.
    pub mark: Mark,
    /// Which of the colours; lines of one colour belong together.
    pub colour: usize,
}

impl Line {
    /// What was measured: points with error bars, and a line through them.
    #[must_use]
    pub fn measured(name: impl Into<String>, colour: usize, points: Vec<(f64, Estimate)>) -> Self {
        Self { name: name.into(), points, mark: Mark::Points, colour }
    }

    /// A curve.
    #[must_use]
    pub fn curve(
        name: impl Into<String>,
        colour: usize,
        mark: Mark,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let points = points.into_iter().map(|(x, y)| (x, Estimate::exact(y))).collect();
        Self { name: name.into(), points, mark, colour }
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Filled points with error bars, joined by a line.
    Points,
    /// Open points with error bars, joined by a dashed line: a variant of the filled ones of its colour.
    OpenPoints,
    /// A line.
    Curve,
    /// A dashed line.
    Dashed,
    /// A thin grey line, to read the others by.
    Guide,
}

/// Colours over a plane: equal cells.
#[derive(Clone, Debug)]
pub struct Map {
    /// Name of its file, without ending.
    pub name: &'static str,
    /// What stands over it.
    pub title: String,
    /// What it shows, in a line below that.
    pub shows: String,
    /// Left to right; linear.
    pub x: Axis,
    /// Bottom to top; linear.
    pub y: Axis,
    /// Values of the columns from left to right, each from bottom to top; `None` is grey. Where any is below 0 colours diverge: white is 0, red
    /// above and blue below.
    pub columns: Vec<Vec<Option<f64>>>,
    /// What the colours stand for.
    pub legend: String,
    /// The value of the brightest colour; more is not brighter. Where colours diverge, the value above and below 0 of the deepest ones.
    pub most: f64,
    /// What grey stands for.
    pub grey: String,
    /// A line over it, and its name.
    pub line: Option<(String, Vec<(f64, f64)>)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_tables_read_back_the_same() {
        let mut table = Table::new("t", &["count", "value", "what"]);
        table.row(&[&3_u64, &(0.1 + 0.2), &"none"]);
        assert_eq!(table.rows, [["3", "0.30000000000000004", "none"]]);
    }
}
