//! To be drawn.

use crate::context::Context;
use crate::gallery::Section;

/// Draws it.
pub(crate) fn draw(_: &Context) -> anyhow::Result<Section> {
    Ok(Section::default())
}
