//! OpenEXR layers and single-channel pictures.
//!
//! The full name of a channel is its layer and its own name, as `ViewLayer.Combined.R`: the layer is the part
//! before the last dot, after the name of the part of the file if that has one. The channels of a layer are a
//! picture if R, G and B are among them, with or without an A, or if there is only one beside A.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{ReadChannels as _, ReadLayers as _, Text};

use super::check_size;
use crate::io::ImageProblem;
use crate::io::memory::with_room;

/// Picture in single precision: R, G, B, and alpha.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<[f32; 4]>,
    pub(super) has_alpha: bool,
}

/// Channels of one part of a file that form a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Layer {
    name: String,
    part: usize,
    /// The indices of R, G and B in the part; three equal ones if there is only one channel.
    colours: [usize; 3],
    alpha: Option<usize>,
}

/// The full name of a channel, prefixed by that of its part unless it begins with it.
fn full_name(part: Option<&Text>, channel: &Text) -> String {
    let channel = channel.to_string();
    match part.map(ToString::to_string) {
        Some(part) if !part.is_empty() && !channel.starts_with(&format!("{part}.")) => {
            format!("{part}.{channel}")
        }
        _ => channel,
    }
}

/// The full names of all channels of a part.
fn names(header: &Header) -> Vec<String> {
    let part = header.own_attributes.layer_name.as_ref();
    header.channels.list.iter().map(|channel| full_name(part, &channel.name)).collect()
}

/// Splits a channel's name into its layer and its name there.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// The pictures of a part.
fn pictures(part: usize, names: &[String]) -> Vec<Layer> {
    let mut layers: Vec<&str> = vec![];
    for name in names {
        let (layer, _) = split(name);
        if !layers.contains(&layer) {
            layers.push(layer);
        }
    }
    let of = |layer: &str| {
        let own: Vec<(usize, &str)> = (names.iter().enumerate())
            .filter_map(|(i, name)| (split(name).0 == layer).then_some((i, split(name).1)))
            .collect();
        let find = |wanted: &str| own.iter().find(|(_, n)| n.eq_ignore_ascii_case(wanted)).map(|(i, _)| *i);
        let alpha = find("A");
        let others: Vec<usize> = own.iter().map(|(i, _)| *i).filter(|&i| Some(i) != alpha).collect();
        let colours = match (find("R"), find("G"), find("B"), &others[..]) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (.., &[one]) => [one; 3],
            _ => return None,
        };
        Some(Layer { name: layer.to_owned(), part, colours, alpha })
    };
    layers.into_iter().filter_map(of).collect()
}

/// Selects the requested picture: a layer, a single channel by its full name, or the channels without a
/// layer; otherwise the only one, or the only one in colours.
fn chosen(parts: &[Vec<String>], layer: Option<&str>) -> Result<Layer, ImageProblem> {
    let all: Vec<Layer> = parts.iter().enumerate().flat_map(|(i, names)| pictures(i, names)).collect();
    let in_colours = |layer: &&Layer| layer.colours[0] != layer.colours[1];
    let only = |mut some: Vec<&Layer>| if some.len() == 1 { some.pop().cloned() } else { None };
    let wanted = layer.unwrap_or_default();
    let found = all.iter().find(|picture| picture.name == wanted).cloned().or_else(|| match layer {
        None => only(all.iter().collect()).or_else(|| only(all.iter().filter(in_colours).collect())),
        Some(channel) => parts.iter().enumerate().find_map(|(part, names)| {
            let at = names.iter().position(|name| name == channel)?;
            Some(Layer { name: channel.to_owned(), part, colours: [at; 3], alpha: None })
        }),
    });
    found.ok_or_else(|| ImageProblem::Layer {
        asked: layer.map(str::to_owned),
        channels: parts.iter().flatten().cloned().collect::<Vec<_>>().join(", "),
    })
}

/// Reads the picture of a layer, or that of the file if it is unambiguous. Outside of the data window it is
/// 0. The declared sizes must have been checked.
pub(super) fn read(bytes: &[u8], layer: Option<&str>) -> Result<Picture, ImageProblem> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)?;
    let parts: Vec<Vec<String>> = meta.headers.iter().map(names).collect();
    let Layer { part, colours, alpha, .. } = chosen(&parts, layer)?;
    let header = meta.headers.get(part).ok_or(ImageProblem::Format)?;
    let window = header.shared_attributes.display_window;
    let (width, height) = (window.size.width(), window.size.height());
    check_size(width, height)?;
    let picked = [colours[0], colours[1], colours[2]].into_iter().chain(alpha);
    let sampled = picked.clone().any(|at| {
        header.channels.list.get(at).is_none_or(|channel| channel.sampling.0 != 1 || channel.sampling.1 != 1)
    });
    if sampled || header.deep {
        return Err(ImageProblem::Sampling);
    }
    // All channels are read at once, some as integers.
    let stored: usize = (meta.headers.iter())
        .map(|h| h.layer_size.area().saturating_mul(h.channels.list.len()).saturating_mul(size_of::<f32>()))
        .fold(0, usize::saturating_add);
    let room = (width * height).saturating_mul(size_of::<[f32; 4]>());
    drop(with_room::<u8>(stored.saturating_mul(2).saturating_add(room), "decoding the pixels")?);
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    let stored = file.layer_data.get(part).ok_or(ImageProblem::Format)?;
    let (columns, rows) = (stored.size.width(), stored.size.height());
    let offset = stored.attributes.layer_position - window.position;
    let mut pixels = vec![[0.0; 4]; width * height];
    for (channel, at) in picked.enumerate() {
        let data = stored.channel_data.list.get(at).ok_or(ImageProblem::Format)?;
        for (i, value) in data.sample_data.values_as_f32().enumerate().take(columns * rows) {
            let place = |i: usize, offset: i32, n: usize| {
                i64::try_from(i)
                    .ok()
                    .and_then(|i| usize::try_from(i + i64::from(offset)).ok())
                    .filter(|&i| i < n)
            };
            let (column, row) = (place(i % columns, offset.0, width), place(i / columns, offset.1, height));
            if let (Some(column), Some(row)) = (column, row) {
                pixels[row * width + column][channel] = value;
            }
        }
    }
    Ok(Picture { width, height, pixels, has_alpha: alpha.is_some() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(names: &[&str]) -> Vec<Vec<String>> {
        vec![names.iter().map(|name| (*name).to_owned()).collect()]
    }

    /// Precedence: the one without a name, then the only one, then the only one in colours.
    #[test]
    fn what_is_clear_needs_no_name() {
        let colours = |names: &[&str]| chosen(&file(names), None).map(|l| (l.colours, l.alpha)).ok();
        assert_eq!(colours(&["B", "G", "R"]), Some(([2, 1, 0], None)));
        assert_eq!(colours(&["A", "B", "G", "R", "depth.Z"]), Some(([3, 2, 1], Some(0))));
        assert_eq!(colours(&["Y"]), Some(([0; 3], None)));
        assert_eq!(colours(&["A", "V"]), Some(([1; 3], Some(0))));
        assert_eq!(
            colours(&["v.Combined.A", "v.Combined.B", "v.Combined.G", "v.Combined.R", "v.Depth.Z"]),
            Some(([3, 2, 1], Some(0)))
        );
        assert_eq!(colours(&["v.Depth.Z"]), Some(([0; 3], None)));
        assert_eq!(colours(&["a.B", "a.G", "a.R", "b.B", "b.G", "b.R"]), None);
        assert_eq!(colours(&["X", "Y", "Z"]), None);
    }

    /// Selection by layer, and of single channels by their full name; an unknown name lists the available
    /// ones.
    #[test]
    fn layers_are_found_by_name() {
        let names = file(&["a.B", "a.G", "a.R", "b.A", "b.B", "b.G", "b.R", "d.Z", "n.X", "n.Y"]);
        let colours = |layer: &str| chosen(&names, Some(layer)).map(|l| (l.colours, l.alpha)).ok();
        assert_eq!(colours("b"), Some(([6, 5, 4], Some(3))));
        assert_eq!(colours("d"), Some(([7; 3], None)));
        assert_eq!(colours("d.Z"), Some(([7; 3], None)));
        assert_eq!(colours("n.Y"), Some(([9; 3], None)));
        assert_eq!(colours("n"), None);
        let message = chosen(&names, Some("c")).unwrap_err().to_string();
        assert!(message.contains("`c`") && message.contains("a.B, a.G, a.R, b.A"), "{message}");
    }
}
