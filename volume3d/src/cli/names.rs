//! Names of a scene, found or suggested.

use anyhow::bail;

/// The index of `id` among `known`.
///
/// # Errors
/// Lists what there is, the most alike first.
pub(super) fn find<'a>(
    what: &str,
    id: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> anyhow::Result<usize> {
    if let Some(index) = known.clone().position(|name| name == id) {
        return Ok(index);
    }
    let mut names: Vec<&str> = known.collect();
    if names.is_empty() {
        bail!("there is no {what} `{id}`: the scene has no {what} at all");
    }
    names.sort_by_key(|name| strsim::osa_distance(id, name));
    bail!("there is no {what} `{id}`; closest first, there are: {}", list(&names));
}

/// Some names, and how many more.
pub(super) fn list(names: &[&str]) -> String {
    /// As many as are read.
    const SHOWN: usize = 12;
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
