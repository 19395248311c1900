//! The keys of scenes as text: `sph-prep help scene`, and the comments of a full scene. The text is generated from the schema, and thus from the
//! types and their comments.

use super::{Scene, schema, yaml};
use crate::error::{Error, Result};
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};
use sph_formats::did_you_mean;
use std::fmt::Write;

/// One key of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// From the top: `domain.ball.radius`; items of a list have no index.
    pub path: String,
    /// Whether it is one of several in a list, as those of `bodies`.
    pub in_list: bool,
    pub description: String,
    /// What is written there: a number, one of some words, keys.
    pub kind: String,
    /// What a number measures, where it measures something.
    pub unit: Option<String>,
    /// `None` where it is unset, or has to be stated.
    pub default: Option<Value>,
    pub is_required: bool,
    pub example: Option<Value>,
    /// Words with what they mean.
    pub choices: Vec<(String, String)>,
    /// Other names that it has.
    pub aliases: Vec<String>,
    pub keys: Vec<Key>,
}

/// Values in one line are no longer than this.
const LONGEST: usize = 110;

/// Width of text.
const WIDTH: usize = 100;

impl Key {
    /// The last word of the path.
    pub fn name(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or(&self.path)
    }

    /// It and all below it.
    pub fn all(&self) -> Vec<&Self> {
        let mut out = vec![self];
        self.keys.iter().for_each(|key| out.extend(key.all()));
        out
    }
}

/// The keys of a scene, in the order in which scenes are printed.
pub fn keys() -> Vec<Key> {
    let schema = Scene::schema_of_first_names();
    let reader = Reader { definitions: &schema["$defs"] };
    reader.keys_of(&schema, &[], &[])
}

struct Reader<'a> {
    definitions: &'a Value,
}

/// A path from the top of a scene: names, and whether a list is in between.
type Path = [(String, bool)];

impl<'a> Reader<'a> {
    /// Follows references, and the one alternative that is no null.
    fn resolved(&self, schema: &'a Value) -> &'a Value {
        if let Some(name) = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
            return self.resolved(&self.definitions[name]);
        }
        if let Some(all) = schema["anyOf"].as_array() {
            let others: Vec<&Value> = all.iter().filter(|s| s["type"] != "null").collect();
            // Of a switch or keys, the keys say more.
            let keys = others.iter().find(|s| s.get("$ref").is_some()).filter(|_| others.len() <= 2);
            if let (Some(one), true) = (keys, others.iter().all(|s| s.get("$ref").is_some() || s["type"] == "boolean"))
            {
                return self.resolved(one);
            }
        }
        schema
    }

    /// `above` are the objects that it is within: a shape of which others are made may hold itself, and is listed once.
    fn keys_of(&self, object: &'a Value, path: &Path, above: &[&'a Value]) -> Vec<Key> {
        if above.iter().any(|one| std::ptr::eq(*one, object)) {
            return Vec::new();
        }
        let above: Vec<&'a Value> = above.iter().copied().chain([object]).collect();
        let required = |name: &str| object["required"].as_array().is_some_and(|r| r.iter().any(|n| n == name));
        if let Some(properties) = object["properties"].as_object() {
            let mut keys: Vec<Key> = properties
                .iter()
                .map(|(name, schema)| self.key(name, schema, path, (required(name), &above)))
                .collect();
            let order = order(path);
            keys.sort_by_key(|key| order.iter().position(|name| name == key.name()).unwrap_or(usize::MAX));
            return keys;
        }
        // Alternatives with keys of their own: each is a key with its keys.
        let tagged = object["oneOf"].as_array().into_iter().flatten().filter(|s| s["properties"].is_object());
        tagged
            .flat_map(|one| one["properties"].as_object().into_iter().flatten().map(move |p| (one, p)))
            .map(|(one, (name, schema))| {
                let mut key = self.key(name, schema, path, (false, &above));
                if let Some(text) = one["description"].as_str() {
                    key.description = plain(text);
                }
                key.aliases = schema::aliases(one);
                if let Some(example) = one["examples"][0].get(name) {
                    key.example = Some(example.clone());
                }
                key
            })
            .collect()
    }

    fn key(&self, name: &str, schema: &'a Value, path: &Path, (is_required, above): (bool, &[&'a Value])) -> Key {
        let inner = self.resolved(schema);
        let items = inner["items"].is_object().then(|| self.resolved(&inner["items"]));
        let is_list = items.is_some_and(|i| i["properties"].is_object());
        let path: Vec<(String, bool)> = path.iter().cloned().chain([(name.to_owned(), is_list)]).collect();
        let with_keys = items.filter(|_| is_list).unwrap_or(inner);
        let keys = self.keys_of(with_keys, &path, above);
        let text = schema["description"].as_str().or(inner["description"].as_str());
        let text = text.or(with_keys["description"].as_str()).unwrap_or("");
        let unit = schema["x-unit"].as_str().map(str::to_owned);
        let stated = schema["examples"].as_array().and_then(|e| e.first());
        // A switch that is off is not written.
        let off = || (schema["type"] == "boolean" && !is_required).then_some(Value::Bool(false));
        let default = schema.get("default").filter(|d| !d.is_null()).cloned().or_else(off);
        let choices = self.choices(inner, items);
        let own = stated.cloned().or_else(|| own_example(inner, &choices, unit.as_deref(), default.as_ref()));
        Key {
            path: path.iter().map(|p| p.0.as_str()).collect::<Vec<_>>().join("."),
            in_list: path.iter().any(|p| p.1),
            description: plain(text),
            kind: self.kind(schema, inner, &keys, &choices),
            example: own.filter(|_| keys.is_empty() || stated.is_some()),
            unit,
            default,
            is_required,
            choices,
            aliases: schema::aliases(schema),
            keys,
        }
    }

    /// Words that can be written, of the value or of the items of a list.
    fn choices(&self, inner: &'a Value, items: Option<&'a Value>) -> Vec<(String, String)> {
        let mut out = Vec::new();
        let words = |schema: &'a Value, out: &mut Vec<(String, String)>| {
            let text = plain(schema["description"].as_str().unwrap_or(""));
            let listed = schema["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
            let is_one = schema["enum"].as_array().is_none_or(|e| e.len() == 1);
            out.extend(
                listed
                    .chain(schema["const"].as_str())
                    .map(|w| (w.to_owned(), if is_one { text.clone() } else { String::new() })),
            );
        };
        let alternatives = ["anyOf", "oneOf"].iter().filter_map(|k| inner[*k].as_array()).flatten();
        for schema in [inner].into_iter().chain(items).chain(alternatives) {
            let schema = self.resolved(schema);
            words(schema, &mut out);
            schema["oneOf"].as_array().into_iter().flatten().for_each(|one| words(one, &mut out));
        }
        let mut seen = Vec::new();
        out.retain(|(word, _)| {
            let is_new = !seen.contains(word);
            seen.push(word.clone());
            is_new
        });
        out
    }

    fn kind(&self, schema: &'a Value, inner: &'a Value, keys: &[Key], choices: &[(String, String)]) -> String {
        let switch = schema["anyOf"].as_array().is_some_and(|a| a.iter().any(|s| s["type"] == "boolean"));
        if inner["items"].is_object() && !keys.is_empty() {
            return "a list of items with these keys".into();
        }
        if !keys.is_empty() {
            let one_of = inner["oneOf"].is_array();
            return match (switch, one_of) {
                (true, _) => "true, false, or keys".into(),
                (_, true) => "one of these".into(),
                _ => "keys".into(),
            };
        }
        let bounds = |s: &Value| match (s["minimum"].as_f64(), s["maximum"].as_f64()) {
            (Some(lo), Some(hi)) if hi < 1e15 => format!(" from {lo} to {hi}"),
            (Some(lo), _) => format!(" from {lo} on"),
            _ => String::new(),
        };
        let one = |s: &Value| -> Option<String> {
            let of = |name: &str| match name {
                "number" => Some(format!("a number{}", bounds(s))),
                "integer" => Some(format!("a whole number{}", bounds(s))),
                "boolean" => Some("true or false".into()),
                "string" if s["pattern"].is_string() && s["pattern"] != super::schema::NUMBER => {
                    Some("a count as text: 1e5, 100k".into())
                }
                "string" if s["pattern"].is_string() => Some("a number with its unit".into()),
                "string" if s.get("enum").is_some() || s.get("const").is_some() => None,
                "string" => Some("text".into()),
                "array" => Some("a list".into()),
                "object" => Some("names with values".into()),
                _ => None,
            };
            match &s["type"] {
                Value::String(name) => of(name),
                Value::Array(names) => names.iter().filter_map(Value::as_str).find_map(of),
                _ => None,
            }
        };
        let mut kinds: Vec<String> = Vec::new();
        if !choices.is_empty() {
            kinds.push("one of the words below".into());
        }
        let alternatives = ["anyOf", "oneOf"].iter().filter_map(|k| inner[*k].as_array()).flatten();
        for schema in [inner].into_iter().chain(alternatives) {
            let resolved = self.resolved(schema);
            kinds.extend(one(resolved));
            let nested = resolved["anyOf"].as_array().into_iter().flatten();
            kinds.extend(nested.filter(|_| !std::ptr::eq(resolved, inner)).filter_map(one));
        }
        if let Some(items) = inner["items"].is_object().then(|| self.resolved(&inner["items"])) {
            kinds.retain(|k| k != "a list");
            let of: Vec<String> =
                items["anyOf"].as_array().into_iter().flatten().chain([items]).filter_map(one).collect();
            kinds.push(if of.is_empty() { "a list".into() } else { format!("a list, each {}", of.join(" or ")) });
        }
        let mut out: Vec<String> = Vec::new();
        kinds.into_iter().for_each(|k| {
            if !out.contains(&k) {
                out.push(k)
            }
        });
        out.join(", or ")
    }
}

/// Names of the keys below a path, in the order in which they are declared: as the reader lists them when it meets another.
fn order(path: &Path) -> Vec<String> {
    let mut text = "{'?': 0}".to_owned();
    for (name, is_list) in path.iter().rev() {
        text = if *is_list { format!("{{'{name}': [{text}]}}") } else { format!("{{'{name}': {text}}}") };
    }
    yaml::known_keys::<Scene>(&text)
}

/// A comment's text in one line.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace("[`", "`").replace("`]", "`")
}

/// What a key's type says of itself by way of example.
fn own_example(
    inner: &Value,
    choices: &[(String, String)],
    unit: Option<&str>,
    default: Option<&Value>,
) -> Option<Value> {
    let one = unit.and_then(super::quantity::example_of).map(Value::String);
    let is_list = inner["type"].as_str() == Some("array")
        || inner["type"].as_array().is_some_and(|t| t.iter().any(|n| n == "array"));
    match (one, is_list) {
        (Some(one), true) => return Some(Value::Array(vec![one; 3])),
        (Some(one), false) => return Some(one),
        _ => {}
    }
    let switch = || (inner["type"] == "boolean").then_some(Value::Bool(true));
    choices.first().map(|c| Value::String(c.0.clone())).or_else(|| default.cloned()).or_else(switch)
}

/// Text in lines of at most [`WIDTH`], each after `lead`.
pub(crate) fn wrapped(text: &str, lead: &str) -> String {
    let (mut out, mut line) = (String::new(), lead.to_owned());
    for word in text.split_whitespace() {
        if line.len() + word.len() + 1 > WIDTH && line.len() > lead.len() {
            let _ = writeln!(out, "{}", line.trim_end());
            line = lead.to_owned();
        }
        line += word;
        line.push(' ');
    }
    let _ = writeln!(out, "{}", line.trim_end());
    out
}

/// The text for a key, or for all of a scene where `path` is empty.
///
/// # Errors
/// A path that leads nowhere, with what is there.
pub fn help(path: &str) -> Result<String> {
    let mut here = keys();
    let mut found: Option<Key> = None;
    for name in path.split('.').filter(|n| !n.is_empty()) {
        let name = name.trim_end_matches("[]");
        let Some(key) = here.iter().find(|k| k.name() == name).cloned() else {
            let names = || here.iter().map(Key::name);
            let known = names().collect::<Vec<_>>().join(", ");
            let place = found.map_or("a scene".to_owned(), |k| format!("'{}'", k.path));
            let rest = if known.is_empty() { format!("{place} has no keys") } else { format!("{place} has {known}") };
            return Err(Error::scene("help", format!("finds no key '{name}'{}; {rest}", did_you_mean(name, names()))));
        };
        here = key.keys.clone();
        found = Some(key);
    }
    Ok(match found {
        Some(key) => of_key(&key),
        None => {
            let lead = "A scene (YAML) says everything that a run needs; every key may be left out but for one of `input` or `bodies`. \
                        `sph-prep help scene.KEY` says more of each, `sph-prep --print-scene --all` prints all of them, and \
                        `sph-prep schema` is for editors.";
            format!("{}\n{}", wrapped(lead, ""), summary(&here))
        }
    })
}

/// Keys with the first sentence on each.
fn summary(keys: &[Key]) -> String {
    let width = keys.iter().map(|k| k.name().len()).max().unwrap_or(0);
    let mut out = String::new();
    for key in keys {
        let first = first_sentence(&key.description);
        let lead = format!("  {:width$}  ", "");
        let text = wrapped(first, &lead);
        let _ = write!(out, "  {:width$}  {}", key.name(), &text[lead.len()..]);
    }
    out
}

/// Up to its end or to where its main clause ends; points within numbers and words end nothing.
fn first_sentence(text: &str) -> &str {
    let ends =
        |(i, c): &(usize, char)| ".;:".contains(*c) && text[i + 1..].chars().next().is_none_or(char::is_whitespace);
    match text.char_indices().find(ends) {
        Some((i, '.')) => &text[..=i],
        Some((i, _)) => &text[..i],
        None => text,
    }
}

fn of_key(key: &Key) -> String {
    let mut out = format!("scene.{}\n{}", key.path, wrapped(&key.description, "  "));
    let mut row = |name: &str, text: &str| {
        let _ = write!(out, "  {name:<9}{}", wrapped(text, "           ").trim_start());
    };
    row("is", &key.kind);
    if !key.aliases.is_empty() {
        row("also", &key.aliases.join(", "));
    }
    if let Some(unit) = &key.unit {
        row("measures", &measure(unit));
    }
    row("default", &default_text(key));
    if let Some(example) = &key.example {
        row("example", &format!("{}: {}", key.name(), flow(example)));
    }
    if !key.choices.is_empty() {
        out += "\n  words\n";
        let width = key.choices.iter().map(|c| c.0.len()).max().unwrap_or(0);
        for (word, text) in &key.choices {
            let lead = format!("    {:width$}  ", "");
            let _ = write!(out, "    {word:width$}  {}", wrapped(text, &lead).trim_start());
            if text.is_empty() {
                out = out.trim_end().to_owned() + "\n";
            }
        }
    }
    if !key.keys.is_empty() {
        out += "\n  keys\n";
        summary(&key.keys).lines().for_each(|line| out += &format!("  {line}\n"));
    }
    out
}

/// What `x-unit` means.
fn measure(unit: &str) -> String {
    match super::quantity::example_of(unit) {
        Some(example) => format!("{unit}: a plain number is in the scene's units, '{example}' in its own"),
        None => format!("{unit} (a plain number)"),
    }
}

fn default_text(key: &Key) -> String {
    match &key.default {
        _ if key.is_required => "none: it has to be stated".into(),
        Some(Value::Object(_)) | Some(Value::Array(_)) if !key.keys.is_empty() => "those of its keys".into(),
        Some(default) => flow(default),
        None => "unset".into(),
    }
}

/// A value as YAML in one line: JSON is.
fn flow(value: &Value) -> String {
    match value {
        Value::String(text) if is_plain(text) => text.clone(),
        Value::String(text) => format!("'{}'", text.replace('\'', "''")),
        Value::Array(items) => format!("[{}]", items.iter().map(flow).collect::<Vec<_>>().join(", ")),
        Value::Object(keys) => {
            let pair = |(k, v): (&String, &Value)| format!("{}: {}", flow(&Value::String(k.clone())), flow(v));
            format!("{{{}}}", keys.iter().map(pair).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

/// Whether YAML takes a word for text as it stands.
fn is_plain(text: &str) -> bool {
    let words = ["true", "false", "yes", "no", "on", "off", "null", "y", "n", "~"];
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_./".contains(c))
        && !words.contains(&text.to_lowercase().as_str())
}

impl Scene {
    /// The JSON Schema (draft 2020-12) of scenes, with which editors complete and check them. Beside the standard's words, `x-unit`
    /// names what a number measures.
    pub fn schema() -> Value {
        let mut schema = Self::schema_of_first_names();
        schema::with_aliases(&mut schema);
        schema
    }

    /// The schema with keys and choices under the first of their names alone, which note the others.
    fn schema_of_first_names() -> Value {
        let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<Self>();
        schema.insert("title".into(), "sph-prep scene".into());
        schema.to_value()
    }

    /// The scene as YAML with every key, unset ones as comments, each under what it means.
    ///
    /// # Errors
    /// As for [`Scene::stated_units`].
    pub fn to_full_yaml(&self) -> Result<String> {
        let values = serde_json::to_value(self)
            .map_err(|e| Error::Numeric { stage: "scene", problem: format!("it cannot be printed: {e}") })?;
        let mut out = self.units_comment()?;
        let empty = Map::new();
        write_keys(&mut out, &keys(), values.as_object().unwrap_or(&empty), (0, false));
        Ok(out)
    }
}

/// A value behind `lead`, in one line if that is not too long, else with a line for each of its items.
fn write_value(out: &mut String, lead: &str, value: &Value, depth: usize) {
    let indent = "  ".repeat(depth + 1);
    let line = format!("{lead} {}", flow(value));
    match value {
        Value::Array(items) if line.len() > LONGEST => {
            let _ = writeln!(out, "{lead}");
            items.iter().for_each(|item| write_item(out, &indent, item, depth));
        }
        Value::Object(keys) if line.len() > LONGEST => {
            let _ = writeln!(out, "{lead}");
            let name = |key: &String| flow(&Value::String(key.clone()));
            keys.iter().for_each(|(key, value)| write_value(out, &format!("{indent}{}:", name(key)), value, depth + 1));
        }
        _ => {
            let _ = writeln!(out, "{line}");
        }
    }
}

/// An item of a list in lines of its own.
fn write_item(out: &mut String, indent: &str, item: &Value, depth: usize) {
    match item.as_object().filter(|_| indent.len() + 2 + flow(item).len() > LONGEST) {
        Some(keys) => {
            for (i, (key, value)) in keys.iter().enumerate() {
                let mark = if i == 0 { "- " } else { "  " };
                let name = flow(&Value::String(key.clone()));
                write_value(out, &format!("{indent}{mark}{name}:"), value, depth + 2);
            }
        }
        None => {
            let _ = writeln!(out, "{indent}- {}", flow(item));
        }
    }
}

/// Keys with their values; those that are unset, or in a section that is, are comments.
fn write_keys(out: &mut String, keys: &[Key], values: &Map<String, Value>, (depth, is_off): (usize, bool)) {
    let indent = "  ".repeat(depth);
    for key in keys {
        let value = values.get(key.name());
        if depth == 0 {
            out.push('\n');
        }
        let unit = key.unit.as_ref().map(|u| format!(" [{u}]")).unwrap_or_default();
        let default = match &key.default {
            _ if key.is_required => " It has to be stated.".to_owned(),
            Some(Value::Object(_) | Value::Array(_)) | None => String::new(),
            Some(default) => format!(" Default: {}.", flow(default)),
        };
        *out += &wrapped(&format!("{}{unit}{default}", key.description), &format!("{indent}# "));
        let words: Vec<&str> = key.choices.iter().map(|c| c.0.as_str()).collect();
        if !words.is_empty() {
            *out += &wrapped(&format!("One of {}.", words.join(", ")), &format!("{indent}# "));
        }
        let name = flow(&Value::String(key.name().to_owned()));
        match value.filter(|_| !is_off) {
            Some(Value::Object(inner)) if !key.keys.is_empty() && !key.kind.starts_with("one of") => {
                if inner.is_empty() && key.keys.iter().all(|k| k.default.is_none()) {
                    let _ = writeln!(out, "{indent}{name}: {{}}");
                    write_keys(out, &key.keys, inner, (depth + 1, true));
                } else {
                    let _ = writeln!(out, "{indent}{name}:");
                    write_keys(out, &key.keys, inner, (depth + 1, false));
                }
            }
            Some(value) => write_value(out, &format!("{indent}{name}:"), value, depth),
            None if key.keys.is_empty() || key.example.is_some() => {
                let example = key.example.as_ref().map_or_else(|| "...".into(), flow);
                let _ = writeln!(out, "{indent}#{name}: {example}");
            }
            None => {
                let _ = writeln!(out, "{indent}#{name}:");
                write_keys(out, &key.keys, &Map::new(), (depth + 1, true));
            }
        }
    }
}
