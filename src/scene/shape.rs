//! Has the scene file the right shape: known keys, nothing missing, right types?
//!
//! The JSON schema that `impinge schema` prints comes from the types in [`super`]; the file is walked against the same
//! schema. So there is one list of keys, and every fault is known by its path, also inside `kind = ...` tables and
//! number-or-table values, where serde itself can only say that no variant fits.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::key::Caret;
use super::{Invalid, Scene};

/// Two keys at least this alike (Jaro–Winkler, 0 to 1) are taken for a misspelling of one another; below, only the list of
/// known keys is shown.
const ALIKE: f64 = 0.75;

/// Longest value that a message repeats in full, characters.
const SHOWN: usize = 60;

/// The JSON schema of scene files.
#[must_use]
pub fn schema() -> Schema {
    schemars::schema_for!(Scene).to_value()
}

/// Walks a whole scene; gives the first fault, and what of it the caret belongs under.
pub(super) fn check(scene: &Table) -> Result<(), (Invalid, Caret)> {
    let root = schema();
    Walk { definitions: &root["$defs"] }.table(&root, scene, "")
}

type Checked = Result<(), (Invalid, Caret)>;

struct Walk<'a> {
    definitions: &'a Schema,
}

impl<'a> Walk<'a> {
    fn value(&self, schema: &'a Schema, value: &Value, path: &str) -> Checked {
        let forms = self.forms(schema);
        let names: Vec<&str> = forms.iter().filter_map(|form| form["const"].as_str()).collect();
        if names.len() == forms.len() {
            return one_of(&names, value, path);
        }
        let fitting: Vec<&Schema> = forms.iter().copied().filter(|form| accepts(form, value)).collect();
        match (value, fitting.as_slice()) {
            (_, []) => Err(self.wrong_type(schema, value, path)),
            (Value::Table(table), [form]) => self.table(form, table, path),
            (Value::Table(table), forms) => self.table(self.variant(forms, table, path)?, table, path),
            (Value::Array(array), [form, ..]) => self.array(form, array, path),
            (Value::Integer(number), [form, ..]) => integer(form, *number, path),
            _ => Ok(()),
        }
    }

    fn table(&self, schema: &'a Schema, table: &Table, path: &str) -> Checked {
        let known = &schema["properties"];
        let names = keys(schema);
        if let Some(name) = table.keys().find(|name| known.get(name).is_none()) {
            return Err((unknown_key(name, &names, path), Caret::Name));
        }
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Schema::as_str) {
            if !table.contains_key(name) {
                return Err((self.missing_key(&known[name], name, path), Caret::Value));
            }
        }
        table.iter().try_for_each(|(name, value)| self.value(&known[name], value, &join(path, name)))
    }

    fn array(&self, schema: &'a Schema, array: &[Value], path: &str) -> Checked {
        let least = schema["minItems"].as_u64();
        if least.is_some_and(|least| array.len() as u64 != least) {
            let what = format!("expected {}, found {} values", self.expected(schema), array.len());
            return Err((Invalid::new(path, what, meaning(schema, path)), Caret::Value));
        }
        array.iter().enumerate().try_for_each(|(i, value)| self.value(&schema["items"], value, &format!("{path}[{i}]")))
    }

    /// Which of several tables this one is meant to be: by its `kind`, or else by the keys it has.
    fn variant(&self, forms: &[&'a Schema], table: &Table, path: &str) -> Result<&'a Schema, (Invalid, Caret)> {
        let kind = |form: &&'a Schema| form["properties"]["kind"]["const"].as_str();
        let kinds: Vec<&str> = forms.iter().filter_map(kind).collect();
        if kinds.is_empty() {
            let in_common = |form: &&&Schema| table.keys().filter(|key| form["properties"].get(key).is_some()).count();
            let best = forms.iter().rev().max_by_key(in_common).expect("there are several forms");
            let stray = table.keys().find(|key| best["properties"].get(key).is_none());
            if let Some(stray) = stray {
                let names: Vec<&str> = forms.iter().flat_map(|form| keys(form)).collect();
                let shapes = forms.iter().map(|form| self.expected(form)).collect::<Vec<_>>().join(" or ");
                let mut fault = unknown_key(stray, &names, path);
                if names.contains(&stray.as_str()) {
                    fault.what = format!("`{stray}` does not go with the other keys here");
                    fault.remedy = format!("give {shapes}");
                } else {
                    fault.remedy = format!("{}; give {shapes}", fault.remedy);
                }
                return Err((fault, Caret::Name));
            }
            return Ok(best);
        }
        let Some(value) = table.get("kind") else {
            let what = "missing key `kind`".to_owned();
            let remedy = format!("add `kind = ...`: one of {}", quoted(&kinds));
            return Err((Invalid::new(join(path, "kind"), what, remedy), Caret::Value));
        };
        one_of(&kinds, value, &join(path, "kind"))?;
        Ok(forms.iter().find(|form| kind(form) == value.as_str()).expect("the kind is one of the kinds"))
    }

    /// All forms that a value may take, references followed, "left out" dropped.
    fn forms(&self, schema: &'a Schema) -> Vec<&'a Schema> {
        if let Some(reference) = schema["$ref"].as_str() {
            let name = reference.rsplit('/').next().unwrap_or_default();
            return self.forms(&self.definitions[name]);
        }
        let choices = schema.get("oneOf").or_else(|| schema.get("anyOf")).and_then(Schema::as_array);
        match choices {
            Some(choices) => {
                choices.iter().flat_map(|choice| self.forms(choice)).filter(|f| f["type"] != "null").collect()
            }
            None => vec![schema],
        }
    }

    /// What a value may be, in words.
    fn expected(&self, schema: &'a Schema) -> String {
        let forms = self.forms(schema);
        let names: Vec<&str> = forms.iter().filter_map(|form| form["const"].as_str()).collect();
        if names.len() == forms.len() {
            return format!("one of {}", quoted(&names));
        }
        let one = |form: &&'a Schema| match kind_of(form) {
            "string" if form["const"].is_string() => format!("{}", form["const"]),
            "number" => "a number".to_owned(),
            "integer" => "a whole number".to_owned(),
            "string" => "a text in quotes".to_owned(),
            "boolean" => "true or false".to_owned(),
            "array" => match form["minItems"].as_u64() {
                Some(length) if kind_of(&form["items"]) == "integer" => format!("{length} whole numbers in brackets"),
                Some(length) => format!("{length} numbers in brackets"),
                None => "an array of tables".to_owned(),
            },
            _ => format!("{{ {} }}", keys(form).join(", ")),
        };
        let tables = forms.iter().filter(|form| form["properties"]["kind"].get("const").is_some()).count();
        match tables {
            0 => forms.iter().map(one).collect::<Vec<_>>().join(" or "),
            _ => "a table with a `kind`".to_owned(),
        }
    }

    fn wrong_type(&self, schema: &'a Schema, value: &Value, path: &str) -> (Invalid, Caret) {
        let what = format!("expected {}, found {}", self.expected(schema), shown(value));
        let forms = self.forms(schema);
        let remedy = match value {
            Value::Float(number) if number.fract() == 0.0 && forms.iter().any(|form| kind_of(form) == "integer") => {
                format!("write it without point and exponent: {number:.0}")
            }
            Value::Table(_) if forms.iter().any(|form| kind_of(form) == "array") => {
                let name = path.rsplit('.').next().unwrap_or(path);
                format!("write `[[{name}]]` with two brackets on each side: there may be several")
            }
            _ => meaning(schema, path),
        };
        (Invalid::new(path, what, remedy), Caret::Value)
    }

    fn missing_key(&self, schema: &'a Schema, name: &str, path: &str) -> Invalid {
        let table = self.forms(schema).iter().all(|form| kind_of(form) == "object") && path.is_empty();
        let description = schema["description"].as_str().unwrap_or_default();
        match table {
            true => Invalid::new(name, format!("missing table `[{name}]`"), format!("add `[{name}]`: {description}")),
            false => {
                let remedy = format!("add `{name} = ...`, {}: {description}", self.expected(schema));
                Invalid::new(join(path, name), format!("missing key `{name}`"), remedy)
            }
        }
    }
}

/// The TOML type that a form of the schema stands for; an optional value is what it is when it is given.
fn kind_of(form: &Schema) -> &str {
    match &form["type"] {
        Schema::Array(kinds) => {
            kinds.iter().filter_map(Schema::as_str).find(|kind| *kind != "null").unwrap_or_default()
        }
        kind => kind.as_str().unwrap_or_default(),
    }
}

fn accepts(form: &Schema, value: &Value) -> bool {
    match value {
        Value::Float(_) => kind_of(form) == "number",
        Value::Integer(_) => matches!(kind_of(form), "number" | "integer"),
        Value::String(text) => kind_of(form) == "string" && form["const"].as_str().is_none_or(|word| word == text),
        Value::Boolean(_) => kind_of(form) == "boolean",
        Value::Array(_) => kind_of(form) == "array",
        Value::Table(_) => kind_of(form) == "object",
        Value::Datetime(_) => false,
    }
}

fn integer(form: &Schema, number: i64, path: &str) -> Checked {
    if kind_of(form) != "integer" {
        return Ok(());
    }
    let most = if form["format"] == "uint32" { i64::from(u32::MAX) } else { i64::MAX };
    if (0..=most).contains(&number) {
        return Ok(());
    }
    Err((Invalid::new(path, format!("{number} is outside 0 to {most}"), meaning(form, path)), Caret::Value))
}

fn one_of(names: &[&str], value: &Value, path: &str) -> Checked {
    let what = match value.as_str() {
        Some(text) if names.contains(&text) => return Ok(()),
        Some(text) => format!("there is no \"{text}\""),
        None => format!("expected one of {}, found {}", quoted(names), shown(value)),
    };
    let remedy = match value.as_str().and_then(|text| nearest(text, names)) {
        Some(name) => format!("did you mean \"{name}\"? It is one of {}", quoted(names)),
        None => format!("use one of {}", quoted(names)),
    };
    Err((Invalid::new(path, what, remedy), Caret::Value))
}

fn unknown_key(name: &str, known: &[&str], path: &str) -> Invalid {
    let remedy = match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`? Known here: {}", known.join(", ")),
        None => format!("take it out; known here: {}", known.join(", ")),
    };
    Invalid::new(join(path, name), format!("unknown key `{name}`"), remedy)
}

fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let likeness = |other: &&str| strsim::jaro_winkler(name, other);
    let best = known.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(&best) >= ALIKE).then_some(best)
}

fn keys(schema: &Schema) -> Vec<&str> {
    schema["properties"].as_object().into_iter().flatten().map(|(name, _)| name.as_str()).collect()
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}

fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// What the key means, as the schema has it.
fn meaning(schema: &Schema, path: &str) -> String {
    let name = path.rsplit('.').next().unwrap_or(path);
    match schema["description"].as_str() {
        Some(description) => format!("`{name}` is: {description}"),
        None => format!("correct `{name}`; `impinge schema` describes every key"),
    }
}

/// A value as it would stand in the file, cut when it is long.
fn shown(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(SHOWN) {
        Some((cut, _)) => format!("{}...", &text[..cut]),
        None => text,
    }
}
