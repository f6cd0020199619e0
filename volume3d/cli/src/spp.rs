//! The number of samples per pixel, as an option.

use std::path::PathBuf;

use anyhow::bail;
pub(super) use volume3d::tune::MAX_SAMPLES;

/// Parses a number of samples per pixel.
pub(super) fn samples(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=MAX_SAMPLES).contains(n));
    number.ok_or_else(|| format!("expected a whole number from 1 to {MAX_SAMPLES}"))
}

/// Refuses a standard error from one sample.
pub(super) fn check_error_exists(path: Option<&PathBuf>, samples: usize) -> anyhow::Result<()> {
    if path.is_some() && samples < 2 {
        bail!("a standard error needs at least 2 samples per pixel, not {samples}; raise --spp");
    }
    Ok(())
}
