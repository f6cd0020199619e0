//! Parses a configuration.

use std::path::Path;

use anyhow::anyhow;

use super::config::Config;
use super::message;

/// An example with all keys, which runs.
pub(super) const EXAMPLE: &str = include_str!("example.toml");

/// Parses a configuration. Its relative paths are resolved against its folder. `path` is also for messages.
pub(super) fn parse(text: &str, path: &Path) -> anyhow::Result<Config> {
    let mut config: Config =
        toml::from_str(text).map_err(|error| anyhow!(message::of(&error, text, path)))?;
    for parameter in config.parameters.iter_mut().filter(|parameter| parameter.name.is_empty()) {
        parameter.name = parameter.tie.first().cloned().unwrap_or_default();
    }
    config.check().map_err(|problem| anyhow!(message::with_line(&problem.to_string(), text, path)))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    for file in config.files_mut() {
        *file = folder.join(&*file);
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All keys of the example with their tables, including those in comments.
    fn keys_of_example() -> Vec<(String, String)> {
        let (mut table, mut found) = (String::new(), vec![]);
        for line in EXAMPLE.lines() {
            let bare = line.strip_prefix("#   ").or_else(|| line.strip_prefix('#')).unwrap_or(line);
            if bare.starts_with('[') {
                table = bare.trim_matches(['[', ']']).to_owned();
            } else if let Some((key, value)) = bare.split_once(" = ")
                && key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
            {
                let line = format!("{key} = {value}");
                assert!(toml::from_str::<toml::Table>(&line).is_ok(), "{line}");
                found.push((table.clone(), key.to_owned()));
            }
        }
        found
    }

    #[test]
    fn the_example_has_every_key_and_no_other() {
        parse(EXAMPLE, Path::new("fit.toml")).unwrap();
        let found = keys_of_example();
        let mut known = vec![];
        for (table, keys) in message::keys_by_table() {
            if table == "gradient" {
                // An inline table has several keys in one line.
                assert!(keys.iter().all(|key| EXAMPLE.contains(&format!("{key} = "))), "{keys:?}");
                continue;
            }
            assert!(keys.len() > 2, "{table}: {keys:?}");
            known.extend(keys.into_iter().map(|key| (table.to_owned(), key)));
        }
        let tables = ["reference", "view", "parameter", "regularizer", "masks", "dtu", "photographs"];
        known.retain(|(table, key)| !(table.is_empty() && tables.contains(&key.as_str())));
        for key in &known {
            assert!(found.contains(key), "{key:?} is not in the example");
        }
        for key in &found {
            assert!(known.contains(key), "{key:?} is no key");
        }
    }
}
