//! The best setting for a time or an error, as a command line.

use std::fmt::Write as _;

use super::law::{Expected, Law};
use super::settings::Setting;
use crate::movement::Move;
use crate::session::SceneOptions;

/// A measured setting, with its error law.
pub(super) struct Tuned<'a> {
    pub(super) setting: &'a Setting,
    pub(super) law: Law,
    /// Whether single samples carry so much that the numbers are unreliable.
    pub(super) heavy: bool,
}

/// The target of an advice.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// The smallest error within a time in seconds.
    Seconds(f64),
    /// The shortest time to an error.
    Error(f64),
}

/// The best setting for a target, with its expected error and time.
pub(super) fn best<'a, 't>(tuned: &'t [Tuned<'a>], target: Target) -> Option<(&'t Tuned<'a>, Expected)> {
    let able = tuned.iter().filter_map(|t| {
        let expected = match target {
            Target::Seconds(seconds) => t.law.within(seconds),
            Target::Error(error) => t.law.reaching(error),
        };
        expected.map(|e| (t, e))
    });
    let cost = |e: &Expected| match target {
        Target::Seconds(_) => e.error.value,
        Target::Error(_) => e.seconds,
    };
    able.min_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1)))
}

/// The best setting as text, or the reason why there is none.
pub(super) fn advice(tuned: &[Tuned<'_>], target: Target, scene: &SceneOptions, moves: &[Move]) -> String {
    let mut text = String::new();
    let wanted = match target {
        Target::Seconds(seconds) => format!("within {seconds} s"),
        Target::Error(error) => format!("for an error of {}", percent(error)),
    };
    let Some((tuned, Expected { samples, seconds, error })) = best(tuned, target) else {
        let why = match target {
            Target::Seconds(_) => "every setting takes longer with one sample per pixel",
            Target::Error(_) => "every measured setting has a larger bias, or would need too many samples",
        };
        return format!("{wanted}: {why}\n");
    };
    let (value, error) = (percent(error.value), percent(error.error));
    let _ = writeln!(text, "{wanted}: expected error {value} ± {error} in {seconds:.3} s");
    let _ = writeln!(text, "  {}", command(tuned.setting, samples, scene, moves));
    if samples > FAR * tuned.law.measured {
        let measured = tuned.law.measured;
        let _ =
            writeln!(text, "  extrapolated from {measured} spp; a larger --budget makes this more reliable");
    }
    if tuned.heavy {
        text += "  its tails are heavy: the error may be larger than expected\n";
    }
    text
}

/// An expectation is called extrapolated above this factor on the measured number of samples.
const FAR: usize = 64;

/// The command line.
fn command(setting: &Setting, samples: usize, scene: &SceneOptions, moves: &[Move]) -> String {
    let mut words = vec!["volume3d".to_owned(), "gradient".to_owned()];
    words.extend(scene.words());
    words.extend(moves.iter().flat_map(|m| ["--move".to_owned(), m.to_string()]));
    words.extend(setting.options.split_whitespace().map(str::to_owned));
    words.extend(["--spp", &samples.to_string(), "-o", "gradient.exr"].map(str::to_owned));
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// Quotes a word for a shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./:,=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A fraction as a percentage with at least two digits.
pub(super) fn percent(part: f64) -> String {
    let value = 100.0 * part;
    let digits =
        if value >= 10.0 || value == 0.0 { 0 } else { (1.0 - value.log10().floor()).min(6.0) as usize };
    format!("{value:.digits$}%")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_a_shell() {
        assert_eq!(quoted("a/b:c,1.5=-2"), "a/b:c,1.5=-2");
        assert_eq!(quoted("my scene's.xml"), r"'my scene'\''s.xml'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn percentages_keep_two_digits() {
        let cases = [(0.0, "0%"), (0.12345, "12%"), (0.0312, "3.1%"), (1.5e-3, "0.15%"), (12.3, "1230%")];
        for (part, text) in cases {
            assert_eq!(percent(part), text);
        }
    }
}
