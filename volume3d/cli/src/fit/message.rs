//! Error messages about a configuration, in terms of TOML and its keys.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::config::{
    Config, DtuConfig, GradientConfig, MasksConfig, PhotographsConfig, Reference, RegularizerConfig,
    ViewConfig,
};
use super::parameter::ParameterConfig;

/// A table of a configuration: its syntax, its keys, and whether there may be several.
struct Table {
    name: &'static str,
    written: &'static str,
    is_list: bool,
    keys: fn() -> Vec<String>,
}

const TABLES: [Table; 9] = [
    Table {
        name: "",
        written: "the top of the file, above the first [table]",
        is_list: false,
        keys: keys::<Config>,
    },
    Table { name: "gradient", written: "gradient = { … }", is_list: false, keys: keys::<GradientConfig> },
    Table { name: "reference", written: "[reference]", is_list: false, keys: keys::<Reference> },
    Table { name: "view", written: "[[view]]", is_list: true, keys: keys::<ViewConfig> },
    Table { name: "parameter", written: "[[parameter]]", is_list: true, keys: keys::<ParameterConfig> },
    Table { name: "regularizer", written: "[[regularizer]]", is_list: true, keys: keys::<RegularizerConfig> },
    Table { name: "masks", written: "[masks]", is_list: false, keys: keys::<MasksConfig> },
    Table { name: "dtu", written: "[dtu]", is_list: false, keys: keys::<DtuConfig> },
    Table { name: "photographs", written: "[photographs]", is_list: false, keys: keys::<PhotographsConfig> },
];

/// The keys of a table, from its deserializer's error for an unknown key.
fn keys<T: DeserializeOwned>() -> Vec<String> {
    let error = toml::from_str::<T>("\"?\" = 1").err();
    let message = error.map(|error| error.message().to_owned()).unwrap_or_default();
    message.split('`').skip(3).step_by(2).map(str::to_owned).collect()
}

/// The names of all tables with their keys, the top level first.
#[cfg(test)]
pub(super) fn keys_by_table() -> Vec<(&'static str, Vec<String>)> {
    TABLES.iter().map(|table| (table.name, (table.keys)())).collect()
}

/// Keys of other programs, with the equivalents here.
const ELSEWHERE: [(&[&str], &str); 9] = [
    (&["learning_rate", "lr", "step_size", "alpha"], "rate = 0.02 in [[parameter]]"),
    (
        &["iterations", "iters", "epochs", "n_steps", "num_steps", "max_steps"],
        "steps = 100 at the top of the file",
    ),
    (
        &["samples", "spp", "sample_count"],
        "gradient = { spp = 16 } at the top of the file, or spp = 256 in [reference]",
    ),
    (&["optimizer", "optimiser"], "rate, beta1 and beta2 in [[parameter]], of the optimiser Adam"),
    (&["image", "photo", "photograph", "picture", "file", "path"], "target = \"photo.png\" in [[view]]"),
    (&["init", "initial", "x0", "initial_value", "value"], "start = [0, 0, 0] in [[parameter]]"),
    (&["position", "eye", "camera", "from"], "origin = [0, 1, 4] in [[view]]"),
    (&["to", "lookat"], "look_at = [0, 0, 0] in [[view]]"),
    (&["restarts", "multistart"], "starts = 8 at the top of the file"),
];

/// Descriptions of the types that serde names.
const TYPES: [(&str, &str); 12] = [
    ("f64", "a number, such as 0.5"),
    ("u64", "a whole number, 0 or more"),
    ("usize", "a whole number, 0 or more"),
    ("a string", "text in quotes"),
    ("path string", "a path in quotes"),
    ("a boolean", "true or false"),
    ("a sequence", "a list in brackets, such as [0, 1, 0]"),
    ("internally tagged enum LossKind", "a table, such as loss = { kind = \"l2\" }"),
    ("internally tagged enum Schedule", "a table, such as schedule = { kind = \"constant\" }"),
    ("struct GradientConfig", "a table, such as gradient = { spp = 16 }"),
    ("struct Reference", "a table: a line [reference], with its keys below"),
    ("a map", "a table, such as define = { size = \"64\" }"),
];

/// The syntax of required keys, by table and name.
const NEEDED: [(&str, &str, &str); 10] = [
    ("", "scene", "scene = \"scene.xml\""),
    ("", "steps", "steps = 100"),
    ("reference", "scene", "scene = \"scene.xml\""),
    ("parameter", "rate", "rate = 0.02, the approximate size of a step in the parameter's units"),
    ("regularizer", "shape", "shape = \"bunny\""),
    ("regularizer", "kind", "kind = \"laplacian\""),
    ("regularizer", "weight", "weight = 0.1"),
    ("masks", "shape", "shape = \"thing\""),
    ("dtu", "folder", "folder = \"scan65\""),
    ("photographs", "cameras", "cameras = \"transforms.json\""),
];

/// The full message for a syntax or type error.
pub(super) fn of(error: &toml::de::Error, text: &str, path: &Path) -> String {
    let at = error.span().map_or(0, |span| span.start).min(text.len());
    let number = 1 + text[..at].matches('\n').count();
    let line = text.lines().nth(number - 1).unwrap_or_default().trim();
    let what = explained(error.message(), text, at, line);
    if is_of_whole_file(error.message(), table(text, at)) {
        return format!("{}: {what}", path.display());
    }
    format!("{}: line {number}: {what}", path.display())
}

/// A key missing at the top level has no line number.
fn is_of_whole_file(message: &str, table: &str) -> bool {
    let key = message.strip_prefix("missing field `").map(|rest| rest.trim_end_matches('`'));
    key.is_some_and(|key| NEEDED.iter().any(|(of, name, _)| of.is_empty() && *name == key))
        && table.is_empty()
}

/// The full message for an error found after parsing: its line is that of the first name that it quotes.
pub(super) fn with_line(problem: &str, text: &str, path: &Path) -> String {
    let quoted = problem.split('`').skip(1).step_by(2);
    let line = quoted.filter(|name| !name.is_empty()).find_map(|name| {
        let found = text.lines().position(|line| {
            let line = line.split('#').next().unwrap_or_default();
            line.contains(&format!("\"{name}\"")) || line.contains(&format!("'{name}'"))
        });
        found.map(|index| index + 1)
    });
    match line {
        Some(line) => format!("{}: line {line}: {problem}", path.display()),
        None => format!("{}: {problem}", path.display()),
    }
}

fn explained(message: &str, text: &str, at: usize, line: &str) -> String {
    let table = table(text, at);
    if let Some(problem) = brackets(message, line) {
        return problem;
    }
    if let Some(rest) = message.strip_prefix("unknown field `") {
        return unknown(rest.split('`').next().unwrap_or_default(), message, table);
    }
    if let Some(rest) = message.strip_prefix("missing field `") {
        return missing(rest.trim_end_matches('`'), table, line);
    }
    let wrong = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "));
    if let Some((found, wanted)) = wrong.and_then(|rest| rest.rsplit_once(", expected ")) {
        return mistyped(found, wanted, key(text, at));
    }
    if message.starts_with("unknown variant") {
        let key = key(text, at);
        let key = if key.is_empty() { String::new() } else { format!("{key}: ") };
        return format!("{key}{message}{}", suggestion(message));
    }
    if message.starts_with("duplicate key") {
        return format!(
            "`{}` is given twice; keep one of them",
            line.split('=').next().unwrap_or_default().trim()
        );
    }
    if message.starts_with("expected ") {
        return format!("{}: {message}", key(text, at));
    }
    format!("`{line}` is not TOML: {message}{}", syntax(message, line))
}

/// The message for [name] in place of [[name]], or the reverse.
fn brackets(message: &str, line: &str) -> Option<String> {
    let name = line.trim_matches(['[', ']', ' ']);
    let table = TABLES.iter().find(|table| !table.name.is_empty() && table.name == name)?;
    let is_double = line.starts_with("[[");
    if !message.starts_with("invalid type") || !line.starts_with('[') || is_double == table.is_list {
        return None;
    }
    Some(if table.is_list {
        format!("write [[{name}]] instead of [{name}]: there may be several")
    } else {
        format!("write [{name}] instead of [[{name}]]: there is only one")
    })
}

fn unknown(key: &str, message: &str, table: &str) -> String {
    let here = TABLES.iter().find(|t| t.name == table).map_or("this table", |table| table.written);
    let at = if table.is_empty() { "at" } else { "in" };
    let home = TABLES.iter().filter(|other| other.name != table && (other.keys)().iter().any(|k| k == key));
    let homes: Vec<&str> = home.map(|table| table.written).collect();
    if !homes.is_empty() {
        let here = if table.is_empty() {
            "the top of the file".to_owned()
        } else {
            format!("{here}, under which it stands")
        };
        return format!("`{key}` is not a key of {here}; it belongs to {}", homes.join(" or "));
    }
    let near = suggestion(message);
    if !near.is_empty() {
        return format!("there is no key `{key}` {at} {here}{near}");
    }
    let written = ELSEWHERE.iter().find(|(words, _)| words.contains(&key)).map(|(_, written)| written);
    if let Some(written) = written {
        return format!("there is no key `{key}` {at} {here}; its equivalent is {written}");
    }
    let known: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
    if known.is_empty() {
        return format!("this kind has no key `{key}`");
    }
    format!("there is no key `{key}` {at} {here}, whose keys are {}", known.join(", "))
}

fn missing(key: &str, table: &str, line: &str) -> String {
    let written =
        NEEDED.iter().find(|(of, name, _)| *of == table && *name == key).map(|(.., written)| *written);
    if table.is_empty() && !line.starts_with("loss") && !line.starts_with("schedule") {
        return format!(
            "there is no `{key}` at the top of the file; add {}",
            written.map_or_else(|| format!("`{key}`"), str::to_owned)
        );
    }
    match written {
        Some(written) => format!("`{line}` has no `{key}`; add {written}"),
        None if key == "kind" => format!(
            "`{line}` has no kind; a loss has {{ kind = \"l2\" }}, a schedule {{ kind = \"cosine\" }}, for example"
        ),
        None => format!("`{key}` is missing in `{line}`"),
    }
}

fn mistyped(found: &str, wanted: &str, key: &str) -> String {
    let (is_text, is_float) = (found.starts_with("string "), found.starts_with("floating point "));
    let shown = match found {
        "sequence" => "a list",
        "map" => "a table",
        text if is_text => text.trim_start_matches("string "),
        other => other.split('`').nth(1).unwrap_or(other),
    };
    let known = TYPES.iter().find(|(name, _)| *name == wanted);
    let wanted_here = known.map_or(wanted, |(_, words)| *words);
    let advice = match wanted {
        "f64" | "u64" | "usize" if is_text => "; leave out the quotes",
        "u64" | "usize" if is_float => "; leave out the decimal point",
        "a string" | "path string" if !is_text => "; put it in quotes",
        _ => "",
    };
    format!("{key} is {shown}, but must be {wanted_here}{advice}")
}

/// Advice for text that is not TOML.
fn syntax(message: &str, line: &str) -> &'static str {
    let is_of_value = line.contains('=');
    if line.starts_with('{') {
        "; a configuration is TOML, with lines such as steps = 100, and not JSON"
    } else if line.ends_with(';') || line.ends_with(',') {
        "; lines end without a comma or semicolon"
    } else if !is_of_value && line.contains(':') {
        "; write KEY = VALUE"
    } else if message.contains("escape") || message.contains("unicode") || line.contains('\\') {
        "; in quotes \\ begins an escape: write paths with /"
    } else if line.contains("True") || line.contains("False") {
        "; write true and false in small letters"
    } else if message.contains("quoted") {
        "; write text and paths in quotes"
    } else if message.contains("expected newline") {
        "; write one key per line, and numbers with a decimal point"
    } else {
        ""
    }
}

/// The most similar known name, for a message that quotes an unknown name and then the known ones in
/// backticks.
fn suggestion(message: &str) -> String {
    let mut names = message.split('`').skip(1).step_by(2);
    let (Some(unknown), true) = (names.next(), message.starts_with("unknown ")) else { return String::new() };
    let nearest = names.min_by_key(|known| strsim::osa_distance(unknown, known));
    match nearest.filter(|known| strsim::osa_distance(unknown, known) <= 1 + unknown.len() / 3) {
        Some(known) => format!("; did you mean `{known}`?"),
        None => String::new(),
    }
}

/// The name of the table at a position of the text; empty at the top level.
fn table(text: &str, at: usize) -> &str {
    let end = text[at..].find('\n').map_or(text.len(), |length| at + length);
    let mut headers = text[..end].lines().map(str::trim).filter(|line| line.starts_with('['));
    let table = headers
        .next_back()
        .map_or("", |line| line.split(']').next().unwrap_or(line).trim_matches(['[', ' ']));
    let before = text[..at].rsplit('\n').next().unwrap_or_default();
    // An inline table.
    match before.rsplit_once('{') {
        Some((name, rest)) if !rest.contains('}') => {
            let name = name.trim_end().trim_end_matches('=').trim();
            TABLES.iter().map(|table| table.name).find(|known| *known == name).unwrap_or(table)
        }
        _ => table,
    }
}

/// The key whose value is at a position of the text.
fn key(text: &str, at: usize) -> &str {
    let Some(before) = text[..at].rsplit_once('=').map(|(before, _)| before.trim_end()) else { return "" };
    let is_key = |c: char| c.is_alphanumeric() || "_-.\"".contains(c);
    &before[before.trim_end_matches(is_key).len()..]
}
