//! Paths of keys, as in `source[1].count`, and what they lead to.

use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// The names and indices that lead from the top of the file to a value; an index is kept as its digits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct KeyPath(Vec<String>);

/// What the caret goes under.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Caret {
    /// The name of the key.
    Name,
    /// The value that stands behind it.
    Value,
}

impl KeyPath {
    /// Reads `source[0].count`, `source.0.count` alike; nothing when a name is missing.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let steps: Vec<String> =
            text.replace('[', ".").replace(']', "").split('.').map(|s| s.trim().to_owned()).collect();
        steps.iter().all(|step| !step.is_empty()).then_some(Self(steps))
    }

    /// How many steps two paths have in common at their beginnings.
    pub(super) fn common(&self, other: &Self) -> usize {
        self.0.iter().zip(&other.0).take_while(|(a, b)| a == b).count()
    }

    /// Number of steps.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Where the deepest part of this path that is in the file stands (bytes), and how many steps lead there.
    pub(super) fn find(&self, root: &Spanned<DeTable<'_>>, caret: Caret) -> (Range<usize>, usize) {
        let mut found = (root.span(), 0);
        let Some((first, rest)) = self.0.split_first() else { return found };
        let Some((name, mut value)) = root.get_ref().get_key_value(first.as_str()) else { return found };
        let mut name = Some(name.span());
        let mut rest = rest.iter();
        loop {
            found = (value.span(), found.1 + 1);
            let Some(step) = rest.next() else { break };
            let next = match value.get_ref() {
                DeValue::Table(table) => {
                    table.get_key_value(step.as_str()).map(|(name, value)| (Some(name.span()), value))
                }
                DeValue::Array(array) => step.parse().ok().and_then(|i: usize| array.get(i)).map(|value| (None, value)),
                _ => None,
            };
            let Some(next) = next else { return found };
            (name, value) = next;
        }
        match name {
            Some(name) if caret == Caret::Name => (name, found.1),
            _ => found,
        }
    }

    /// Puts `new` where this path leads; tables on the way that are not there yet are made.
    ///
    /// # Errors
    /// What is wrong and what to do when the path leads through something that is no table, or past the end of an array.
    pub(super) fn set(&self, root: &mut Table, new: Value) -> Result<(), (String, String)> {
        let (last, way) = self.0.split_last().expect("a parsed path has at least one step");
        let mut table = root;
        let mut steps = way.iter().enumerate();
        while let Some((mut depth, step)) = steps.next() {
            let mut here = table.entry(step.as_str()).or_insert_with(|| Value::Table(Table::new()));
            while let Value::Array(array) = here {
                let name = way[..=depth].join(".");
                let Some((deeper, index)) = steps.next() else {
                    return element(array, &name, last).map(|place| *place = new);
                };
                here = element(array, &name, index)?;
                depth = deeper;
            }
            let Value::Table(inside) = here else {
                let name = way[..=depth].join(".");
                let what = format!("`{name}` is {here}, not a table, so it has no `{last}`");
                return Err((what, format!("give all of it, as in `--set '{name}={{ {last} = ... }}'`")));
            };
            table = inside;
        }
        table.insert(last.clone(), new);
        Ok(())
    }
}

fn element<'a>(array: &'a mut [Value], name: &str, index: &str) -> Result<&'a mut Value, (String, String)> {
    let length = array.len();
    let fault = || {
        let remedy = match length {
            0 => format!("`{name}` is empty in the scene file"),
            _ => format!("`{name}` has the entries 0 to {}", length - 1),
        };
        (format!("there is no `{name}[{index}]`"), remedy)
    };
    index.parse().ok().and_then(|i: usize| array.get_mut(i)).ok_or_else(fault)
}
