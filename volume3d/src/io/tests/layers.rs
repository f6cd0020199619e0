//! OpenEXR pictures with one channel and with several layers.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding as Compression, FlatSamples, Image as File, IntegerBounds, Layer,
    LayerAttributes, Text, Vec2, WritableImage,
};
use glam::DVec3;

use crate::io::{Encoding, load_image, load_image_over, read_image};

const SIZE: (usize, usize) = (3, 2);

/// A part of a file whose k-th channel is k + 1 + i/8 at pixel i.
fn part(name: &str, channels: &[&str]) -> Layer<AnyChannels<FlatSamples>> {
    let of = |(k, name): (usize, &&str)| {
        let samples = (0..SIZE.0 * SIZE.1).map(|i| k as f32 + 1.0 + i as f32 / 8.0).collect();
        AnyChannel::new(*name, FlatSamples::F32(samples))
    };
    let channels = AnyChannels::sort(channels.iter().enumerate().map(of).collect());
    let named = if name.is_empty() {
        LayerAttributes::default()
    } else {
        LayerAttributes::named(Text::new_or_panic(name))
    };
    Layer::new(SIZE, named, Compression::FAST_LOSSLESS, channels)
}

fn write(path: &Path, parts: &[Layer<AnyChannels<FlatSamples>>]) {
    let attributes = exr::prelude::ImageAttributes::with_size(SIZE);
    let file = File { attributes, layer_data: parts.iter().cloned().collect::<exr::prelude::Layers<_>>() };
    file.write().to_file(path).unwrap();
}

/// The first pixel of a layer.
fn first(path: &Path, layer: Option<&str>) -> Result<DVec3, String> {
    let image = load_image_over(path, DVec3::splat(8.0), Encoding::File, layer);
    image.map(|image| image.pixels[0]).map_err(|e| e.to_string())
}

#[test]
fn one_channel_is_grey() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("y.exr");
    for name in ["Y", "V", "depth.Z"] {
        write(&path, &[part("", &[name])]);
        let image = load_image(&path, false).unwrap();
        assert_eq!(image.size(), SIZE);
        assert_eq!(image.pixels[5], DVec3::splat(1.625), "{name}");
    }
}

#[test]
fn layers_are_chosen_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let depth = "View.Depth.Z";
    let colours = ["View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Combined.A"];
    write(&path, &[part("", &[&colours[..], &[depth]].concat())]);
    // The only layer with colours, over a background of 8 with its alpha of 4.
    let combined = DVec3::new(1.0, 2.0, 3.0) - 24.0;
    assert_eq!(first(&path, None), Ok(combined));
    assert_eq!(first(&path, Some("View.Combined")), Ok(combined));
    assert_eq!(first(&path, Some("View.Depth")), Ok(DVec3::splat(5.0)));
    assert_eq!(first(&path, Some("View.Combined.G")), Ok(DVec3::splat(2.0)));
    let message = first(&path, Some("Combined")).unwrap_err();
    assert!(message.contains("no layer `Combined`") && message.contains(depth), "{message}");
    // Two layers with colours, as separate named parts.
    write(&path, &[part("left", &["R", "G", "B"]), part("right", &["B", "G", "R"])]);
    assert_eq!(first(&path, Some("right")), Ok(DVec3::new(3.0, 2.0, 1.0)));
    let message = first(&path, None).unwrap_err();
    assert!(message.contains("not clear") && message.contains("left.R"), "{message}");
    let png = folder.path().join("a.png");
    crate::io::write_png(&png, &crate::Image::constant(1, 1, DVec3::ONE)).unwrap();
    let message = first(&png, Some("x")).unwrap_err();
    assert!(message.contains("only OpenEXR images have layers"), "{message}");
}

/// The data window may be smaller than the picture, or extend beyond it.
#[test]
fn what_is_stored_is_put_where_it_belongs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("window.exr");
    let mut file = File::from_layer(part("", &["B", "G", "R"]));
    file.attributes.display_window = IntegerBounds::new((0, 0), (2, 3));
    file.layer_data.attributes.layer_position = Vec2(-1, 1);
    file.write().to_file(&path).unwrap();
    let image = read_image(&std::fs::read(&path).unwrap(), &path, false).unwrap();
    assert_eq!(image.size(), (2, 3));
    let green: Vec<f64> = image.pixels.iter().map(|p| p.y).collect();
    assert_eq!(green, [0.0, 0.0, 2.125, 2.25, 2.5, 2.625]);
}
