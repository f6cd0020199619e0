//! The best setting for a time or an error, as a command line.

use std::fmt::Write as _;

use volume3d::tune::{Expected, Setting, Target, Tuning};

use super::settings::options;
use crate::movement::Move;
use crate::session::SceneOptions;

/// The best setting as text, or the reason why there is none.
pub(super) fn advice(tuning: &Tuning, target: Target, scene: &SceneOptions, moves: &[Move]) -> String {
    let mut text = String::new();
    let wanted = match target {
        Target::Seconds(seconds) => format!("within {seconds} s"),
        Target::Error(error) => format!("for an error of {}", percent(error)),
    };
    let Some((tuned, Expected { samples, seconds, error })) = tuning.best(target) else {
        let why = match target {
            Target::Seconds(_) => "every setting takes longer with one sample per pixel",
            Target::Error(_) => "every measured setting has a larger bias, or would need too many samples",
        };
        return format!("{wanted}: {why}\n");
    };
    let (value, error) = (percent(error.value), percent(error.error));
    let _ = writeln!(text, "{wanted}: expected error {value} ± {error} in {seconds:.3} s");
    let _ = writeln!(text, "  {}", command(tuned.setting, samples, scene, moves));
    let measured = tuned.rungs().last().map_or(0, |rung| rung.samples);
    if samples > FAR * measured {
        let _ =
            writeln!(text, "  extrapolated from {measured} spp; a larger --budget makes this more reliable");
    }
    if tuned.is_heavy() {
        text += "  its tails are heavy: the error may be larger than expected\n";
    }
    text
}

/// An expectation is called extrapolated above this factor on the measured number of samples.
const FAR: usize = 64;

/// The command line.
fn command(setting: Setting, samples: usize, scene: &SceneOptions, moves: &[Move]) -> String {
    let mut words = vec!["volume3d".to_owned(), "gradient".to_owned()];
    words.extend(scene.words());
    words.extend(moves.iter().flat_map(|m| ["--move".to_owned(), m.to_string()]));
    words.extend(options(setting).split_whitespace().map(str::to_owned));
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
