//! Image files.

use std::io::Cursor;

use glam::DVec3;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};

use super::{check_messages, encoded, here, message};
use crate::Image;
use crate::io::{
    Encoding, load_image, load_image_over, read_exr, read_image, signed_colour, signed_range,
    write_animation, write_exr, write_png, write_signed_png,
};

fn signed() -> Image {
    let pixels = (0..6).map(|i| DVec3::new(f64::from(i) - 2.5, 0.25, -1e-20)).collect();
    Image { width: 3, height: 2, pixels }
}

#[test]
fn exr_keeps_signed_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let single = |p: &DVec3| p.as_vec3().as_dvec3();
    let expected = Image { pixels: signed().pixels.iter().map(single).collect(), ..signed() };
    write_exr(&path, &signed()).unwrap();
    assert_eq!(read_exr(&path).unwrap(), expected);
    assert_eq!(load_image(&path, false).unwrap(), expected);
}

#[test]
fn exr_keeps_what_is_not_finite_and_textures_refuse_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = signed();
    image.pixels[4].y = f64::NAN;
    write_exr(&path, &image).unwrap();
    assert!(read_exr(&path).unwrap().pixels[4].y.is_nan());
    let found = message(read_image(&std::fs::read(&path).unwrap(), here("a.exr"), false));
    assert_eq!(found, "a.exr: the pixel in column 1, row 1 (from the top left, from 0) is not finite");
}

#[test]
fn png_is_srgb_unless_raw() {
    let eight = ImageBuffer::from_raw(2, 1, vec![0_u8, 128, 255, 10, 11, 12]).unwrap();
    let bytes = encoded(ImageFormat::Png, DynamicImage::ImageRgb8(eight));
    let linear = read_image(&bytes, here("a.png"), false).unwrap();
    // 128/255 in sRGB (IEC 61966-2-1).
    assert!(
        (linear.pixels[0] - DVec3::new(0.0, 0.215_860_500_113_899_26, 1.0)).length() < 1e-15,
        "{linear:?}"
    );
    // 10/255 is below the threshold of 0.04045, so it is divided by 12.92.
    assert!((linear.pixels[1].x - 10.0 / 255.0 / 12.92).abs() < 1e-15);
    let raw = read_image(&bytes, here("a.png"), true).unwrap();
    assert_eq!(raw.pixels[0], DVec3::new(0.0, 128.0 / 255.0, 1.0));

    let sixteen: ImageBuffer<Rgb<u16>, _> = ImageBuffer::from_raw(1, 1, vec![1_u16, 2, 65535]).unwrap();
    let bytes = encoded(ImageFormat::Png, DynamicImage::ImageRgb16(sixteen));
    let raw = read_image(&bytes, here("a.png"), true).unwrap();
    assert_eq!(raw.pixels[0], DVec3::new(1.0, 2.0, 65535.0) / 65535.0);
}

#[test]
fn bmp_is_srgb_as_png_is() {
    let pixels = ImageBuffer::from_raw(2, 1, vec![0_u8, 128, 255, 10, 11, 12]).unwrap();
    let image = DynamicImage::ImageRgb8(pixels);
    let [bmp, png] = [ImageFormat::Bmp, ImageFormat::Png].map(|format| encoded(format, image.clone()));
    let read = |bytes: &[u8]| read_image(bytes, here("a"), false).unwrap();
    assert_eq!(read(&bmp), read(&png));
}

#[test]
fn alpha_is_left_out_and_grey_becomes_colour() {
    let rgba: ImageBuffer<Rgba<u8>, _> = ImageBuffer::from_raw(1, 1, vec![255_u8, 0, 0, 0]).unwrap();
    let bytes = encoded(ImageFormat::Png, DynamicImage::ImageRgba8(rgba));
    assert_eq!(read_image(&bytes, here("a.png"), false).unwrap().pixels, [DVec3::X]);
    let grey: ImageBuffer<Luma<u8>, _> = ImageBuffer::from_raw(1, 1, vec![255_u8]).unwrap();
    let bytes = encoded(ImageFormat::Png, DynamicImage::ImageLuma8(grey));
    assert_eq!(read_image(&bytes, here("a.png"), false).unwrap().pixels, [DVec3::ONE]);
}

/// Half transparent red over blue: half of each in linear light. The colours of OpenEXR are premultiplied.
#[test]
fn transparent_pictures_show_a_background() {
    let folder = tempfile::tempdir().unwrap();
    let half = 128.0 / 255.0;
    let rgba: ImageBuffer<Rgba<u8>, _> =
        ImageBuffer::from_raw(2, 1, vec![255_u8, 0, 0, 128, 0, 255, 0, 255]).unwrap();
    let path = folder.path().join("a.png");
    std::fs::write(&path, encoded(ImageFormat::Png, DynamicImage::ImageRgba8(rgba))).unwrap();
    let over = load_image_over(&path, DVec3::new(0.0, 0.0, 2.0), Encoding::File, None).unwrap().pixels;
    let expected = DVec3::new(half, 0.0, 2.0 * (1.0 - half));
    assert!((over[0] - expected).length() < 1e-6 && over[1] == DVec3::Y, "{over:?}");
    let rgba: ImageBuffer<Rgba<f32>, _> = ImageBuffer::from_raw(1, 1, vec![3.0_f32, 0.5, 0.0, 0.25]).unwrap();
    let path = folder.path().join("a.exr");
    std::fs::write(&path, encoded(ImageFormat::OpenExr, DynamicImage::ImageRgba32F(rgba))).unwrap();
    assert_eq!(
        load_image_over(&path, DVec3::splat(4.0), Encoding::File, None).unwrap().pixels,
        [DVec3::new(6.0, 3.5, 3.0)]
    );
    // Without alpha the picture is unchanged.
    let grey: ImageBuffer<Luma<u8>, _> = ImageBuffer::from_raw(1, 1, vec![255_u8]).unwrap();
    std::fs::write(&path, encoded(ImageFormat::Png, DynamicImage::ImageLuma8(grey))).unwrap();
    assert_eq!(load_image_over(&path, DVec3::X, Encoding::File, None).unwrap().pixels, [DVec3::ONE]);
    assert!(load_image_over(&folder.path().join("none.png"), DVec3::X, Encoding::File, None).is_err());
}

#[test]
fn animations_have_all_their_images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let image = |value: f64| Image::constant(2, 3, DVec3::splat(value));
    write_animation(&path, &[image(0.0), image(1.0), image(0.0)], 40).unwrap();
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
    let mut bytes = [7; 18];
    for value in [0, 255, 0] {
        reader.next_frame(&mut bytes).unwrap();
        assert_eq!(bytes, [value; 18]);
    }
    assert!(write_animation(&path, &[], 40).is_err());
    assert!(write_animation(&path, &[image(0.0), Image::constant(3, 2, DVec3::ONE)], 40).is_err());
}

#[test]
fn radiance_hdr_is_linear() {
    let rgb: ImageBuffer<Rgb<f32>, _> = ImageBuffer::from_raw(1, 1, vec![0.5_f32, 2.0, 8.0]).unwrap();
    let bytes = encoded(ImageFormat::Hdr, DynamicImage::ImageRgb32F(rgb));
    // The channels share an exponent: 8 bits below the largest channel.
    let pixel = read_image(&bytes, here("a.hdr"), false).unwrap().pixels[0];
    assert!((pixel - DVec3::new(0.5, 2.0, 8.0)).abs().max_element() <= 16.0 / 256.0, "{pixel}");
}

#[test]
fn written_png_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let srgb = DVec3::new(0.0, 128.0, 255.0) / 255.0;
    let linear = DVec3::new(0.0, 0.215_860_500_113_899_26, 1.0);
    let image = Image { width: 2, height: 1, pixels: vec![linear, DVec3::new(-1.0, f64::NAN, 9.0)] };
    write_png(&path, &image).unwrap();
    assert_eq!(load_image(&path, true).unwrap().pixels, [srgb, DVec3::Z]);
}

#[test]
fn colours_are_symmetric_and_zero_is_white() {
    assert_eq!(signed_colour(0.0, 2.0), [255, 255, 255]);
    assert_eq!(signed_colour(-0.0, 0.0), [255, 255, 255]);
    assert_eq!(signed_colour(2.0, 2.0), [103, 0, 31]);
    assert_eq!(signed_colour(-9.0, 2.0), [5, 48, 97]);
    assert_eq!(signed_colour(1e-9, 0.0), [103, 0, 31]);
    assert_eq!(signed_colour(0.1, 1.0), [254, 237, 227]);
    assert_eq!(signed_colour(f64::NAN, 1.0), [255, 210, 0]);
    let red = |x: f64| signed_colour(x, 1.0)[0] > signed_colour(x, 1.0)[2];
    assert!((1..=100).all(|i| red(f64::from(i) / 100.0) && !red(f64::from(-i) / 100.0)));
}

#[test]
fn the_range_leaves_outliers_out() {
    let mut image = Image { width: 1000, height: 1, pixels: vec![DVec3::ONE; 1000] };
    image.pixels[3] = -DVec3::splat(1e9);
    image.pixels[4] = DVec3::NAN;
    image.pixels[5..500].fill(DVec3::ZERO);
    assert_eq!(signed_range(&image), 1.0);
    assert_eq!(signed_range(&Image { width: 1, height: 1, pixels: vec![DVec3::ZERO] }), 0.0);
}

#[test]
fn signed_png_states_its_range() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write_signed_png(&path, &signed(), 0.5).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
    let texts = &reader.info().utf8_text;
    assert_eq!(texts[0].keyword, "Range");
    assert_eq!(texts[0].get_text().unwrap(), "mean of R, G, B; blue −5e-1, white 0, red 5e-1");
    let shown = load_image(&path, true).unwrap();
    // The means are (i − 2.25)/3.
    let expected = [-0.75, 0.25 / 3.0, 2.75 / 3.0].map(|x| signed_colour(x, 0.5));
    let found = [0, 3, 5].map(|i| shown.pixels[i].to_array().map(|x| (255.0 * x).round() as u8));
    assert!(found[1..] == [signed_colour(0.75 / 3.0, 0.5), expected[2]], "{found:?}");
}

/// Found by fuzzing: the decoder allocated tiles of any size.
#[test]
fn exr_tiles_larger_than_the_file_are_refused() {
    let image = DynamicImage::ImageRgb32F(ImageBuffer::from_pixel(4, 4, Rgb([0.5_f32; 3])));
    let mut bytes = encoded(ImageFormat::OpenExr, image);
    read_image(&bytes, here("a.exr"), false).unwrap();
    // Width and height follow a name, its type and a length.
    let tiles = b"tiles\0tiledesc\0\x09\0\0\0";
    let at = bytes.windows(tiles.len()).position(|w| w == tiles).unwrap() + tiles.len();
    bytes[at + 4..at + 8].copy_from_slice(&0x1000_0000_u32.to_le_bytes());
    let found = message(read_image(&bytes, here("a.exr"), false));
    let expected = "a.exr: 64×268435456 pixels; expected at least 1×1 and at most 268435456 in all";
    assert_eq!(found, expected);
    bytes[at + 4..at + 8].copy_from_slice(&0x0010_0000_u32.to_le_bytes());
    let found = message(read_image(&bytes, here("a.exr"), false));
    assert_eq!(found, "a.exr: 64×1048576 pixels are announced, which the file is too short for");
}

/// A header of a few bytes does not allocate ten thousand million pixels.
#[test]
fn a_header_that_lies_is_refused() {
    let mut bytes = vec![];
    let mut writer = png::Encoder::new(&mut bytes, 100_000, 100_000).write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[0]).unwrap();
    drop(writer);
    let found = message(read_image(&bytes, here("a.png"), false));
    let expected = "a.png: 100000×100000 pixels; expected at least 1×1 and at most 268435456 in all";
    assert_eq!(found, expected);
}

#[test]
fn errors() {
    let bad = Image { width: 2, height: 2, pixels: vec![DVec3::ZERO; 3] };
    let grey = DynamicImage::ImageRgb32F(ImageBuffer::from_pixel(4, 4, Rgb([0.5_f32; 3])));
    let exr = encoded(ImageFormat::OpenExr, grey);
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("a.png");
    write_png(&png, &signed()).unwrap();
    let found = message(read_exr(&png));
    assert!(found.ends_with("a.png: not a PNG, JPEG, BMP, OpenEXR or Radiance HDR image"), "{found}");
    assert!(message(read_image(&exr[..exr.len() - 20], here("a.exr"), false)).starts_with("a.exr: "));
    check_messages(&[
        (message(write_exr(here("a.exr"), &bad)), "a.exr: 3 pixels given for 2×2"),
        (
            message(write_png(here("a.png"), &Image::default())),
            "a.png: 0×0 pixels; expected at least 1×1 and at most 268435456 in all",
        ),
        (
            message(read_image(b"GIF89a", here("a.gif"), false)),
            "a.gif: not a PNG, JPEG, BMP, OpenEXR or Radiance HDR image",
        ),
        (
            message(read_image(b"#?RADIANCE\n\n-Y 9000 +X 9000\n", here("a.hdr"), false)),
            "a.hdr: 9000×9000 pixels are announced, which the file is too short for",
        ),
    ]);
    assert!(!here("a.exr").exists() && !here("a.png").exists());
}
