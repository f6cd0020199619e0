//! Substitution of `$name`s.

/// Maximum total bytes of substituted values, so that nested values do not exhaust the memory. A scene has at
/// most a million elements, with values of some ten bytes.
pub(super) const MOST_TEXT: usize = 1 << 26;

/// The values of `$name`s.
#[derive(Debug, Default)]
pub(super) struct Variables {
    values: Vec<Variable>,
    /// Total bytes of substituted values so far.
    replaced: usize,
}

/// Errors of substitution.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Problem {
    /// This name has no value.
    Unknown(String),
    /// The values exceed [`MOST_TEXT`].
    TooLong,
}

#[derive(Debug)]
struct Variable {
    name: String,
    value: String,
    used: bool,
}

impl Variables {
    pub(super) fn new(given: &[(String, String)]) -> Self {
        let values = given
            .iter()
            .map(|(name, value)| Variable { name: name.clone(), value: value.clone(), used: false })
            .collect();
        Self { values, replaced: 0 }
    }

    /// Sets a value unless one was given before. It may remain unused.
    pub(super) fn set_default(&mut self, name: &str, value: &str) {
        if !self.values.iter().any(|v| v.name == name) {
            self.values.push(Variable { name: name.to_owned(), value: value.to_owned(), used: true });
        }
    }

    /// `text` with each `$name` replaced, the longest of several matching names; `\$` is a dollar. Values are
    /// not substituted again.
    pub(super) fn substitute(&mut self, text: &str) -> Result<String, Problem> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, after) = (&rest[..at], &rest[at + 1..]);
            if let Some(before) = before.strip_suffix('\\') {
                result.push_str(before);
                result.push('$');
                rest = after;
                continue;
            }
            result.push_str(before);
            let fits = self.values.iter_mut().filter(|v| !v.name.is_empty() && after.starts_with(&v.name));
            let Some(variable) = fits.max_by_key(|v| v.name.len()) else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
                return Err(Problem::Unknown(after[..end].to_owned()));
            };
            variable.used = true;
            self.replaced += variable.value.len();
            if self.replaced > MOST_TEXT {
                return Err(Problem::TooLong);
            }
            result.push_str(&variable.value);
            rest = &after[variable.name.len()..];
        }
        result.push_str(rest);
        Ok(result)
    }

    /// A given value whose name does not occur.
    pub(super) fn unused(&self) -> Option<&str> {
        self.values.iter().find(|v| !v.used).map(|v| v.name.as_str())
    }
}
