//! A page on speed against accuracy: short answers, with the numbers that several figures measure.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};

use crate::gallery::{Gallery, Section};
use crate::output::Table;
use crate::prose::Prose;

/// The page's file.
pub(crate) const FILE: &str = "accuracy.html";

/// The figures whose numbers the page shows.
pub(crate) const FIGURES: [&str; 6] = ["trade", "edges", "specular", "path-bias", "motions", "levels"];

const OPENING: &str = include_str!("opening.md");

/// The parts, each with an anchor and the figures whose data it links.
const PARTS: [(&str, &str, &[&str]); 5] = [
    ("plane", include_str!("plane.md"), &["trade"]),
    ("edges", include_str!("edges.md"), &["edges", "specular"]),
    ("flat-light", include_str!("light.md"), &["path-bias"]),
    ("meshes", include_str!("meshes.md"), &["motions"]),
    ("implicit", include_str!("implicit.md"), &["levels"]),
];

/// Writes the page if all its figures are drawn; tells whether they are.
pub(crate) fn write(gallery: &Gallery<'_>) -> Result<bool> {
    let mut values = BTreeMap::new();
    let mut data: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for name in FIGURES {
        let Some((_, section)) = gallery.sections.iter().find(|(_, section)| section.id == name) else {
            return Ok(false);
        };
        values.extend(section.values.iter().map(|(key, value)| (format!("{name}.{key}"), value.clone())));
        data.insert(name, section.data.clone());
    }
    let section = |id: &str, text: &str, figures: &[&str]| -> Result<Section> {
        let named = || format!("part {id} of {FILE}");
        let lookup =
            |name: &str| values.get(name).cloned().with_context(|| format!("no figure tells {name}"));
        let data = figures.iter().flat_map(|name| data[name].clone()).collect();
        Prose::of(text, lookup).with_context(named)?.section(id, data, Table::default())
    };
    let parts =
        PARTS.iter().map(|(id, text, figures)| section(id, text, figures)).collect::<Result<Vec<_>>>()?;
    gallery.write_summary(FILE, &section("opening", OPENING, &[])?, &parts)?;
    Ok(true)
}
