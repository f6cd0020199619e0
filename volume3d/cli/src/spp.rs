//! Samples a pixel, as an option.

use std::path::PathBuf;

use anyhow::bail;

/// The most samples a pixel: what a day will not see the end of.
pub(super) const MAX_SAMPLES: usize = 1 << 30;

/// A number of samples a pixel.
pub(super) fn samples(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=MAX_SAMPLES).contains(n));
    number.ok_or_else(|| format!("expected a whole number from 1 to {MAX_SAMPLES}"))
}

/// One sample has no spread.
pub(super) fn check_error_exists(path: Option<&PathBuf>, samples: usize) -> anyhow::Result<()> {
    if path.is_some() && samples < 2 {
        bail!("a standard error needs at least 2 samples a pixel, not {samples}; raise --spp");
    }
    Ok(())
}
