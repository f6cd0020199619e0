//! Drawings as PNG files, still or animated, and their versions for dark pages.

use std::io::Cursor;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::output::write_bytes;
use crate::plot::{Canvas, Kept, darkened};

/// Conversion of a drawing to pixels.
pub(crate) type Pixels = fn(&Canvas) -> Vec<u8>;

/// Writes a drawing as PNG.
pub(crate) fn write_png(path: &Path, canvas: &Canvas, pixels: Pixels) -> Result<()> {
    let encode = || -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut writer = png_encoder(&mut bytes, canvas).write_header()?;
        writer.write_image_data(&pixels(canvas))?;
        writer.finish()?;
        Ok(bytes)
    };
    write_bytes(path, &encode().with_context(|| format!("encoding {}", path.display()))?)
}

fn png_encoder<'a>(bytes: &'a mut Vec<u8>, canvas: &Canvas) -> png::Encoder<'static, &'a mut Vec<u8>> {
    encoder_of(bytes, [canvas.pixmap().width(), canvas.pixmap().height()])
}

fn encoder_of(bytes: &mut Vec<u8>, [width, height]: [u32; 2]) -> png::Encoder<'static, &mut Vec<u8>> {
    let mut encoder = png::Encoder::new(bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder
}

/// Writes drawings of one size as an animated PNG that repeats for ever, each shown for `milliseconds`. After
/// the first, a frame stores only the rectangle that changed.
pub(crate) fn write_animation(
    path: &Path,
    frames: &[Canvas],
    milliseconds: u16,
    pixels: Pixels,
) -> Result<()> {
    let [first, rest @ ..] = frames else { bail!("{}: an animation without frames", path.display()) };
    let encode = || -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png_encoder(&mut bytes, first);
        encoder.set_animated(frames.len().try_into()?, 0)?;
        encoder.set_frame_delay(milliseconds, 1000)?;
        let mut writer = encoder.write_header()?;
        let mut shown = pixels(first);
        writer.write_image_data(&shown)?;
        for frame in rest {
            let (next, width) = (pixels(frame), frame.pixmap().width() as usize);
            let [x, y, w, h] = changed(&shown, &next, width);
            let rows = (y..y + h).map(|row| &next[3 * (row * width + x)..][..3 * w]);
            // The position is checked against the size in force, so it is reset first.
            writer.reset_frame_position()?;
            writer.set_frame_dimension(w.try_into()?, h.try_into()?)?;
            writer.set_frame_position(x.try_into()?, y.try_into()?)?;
            writer.write_image_data(&rows.collect::<Vec<_>>().concat())?;
            shown = next;
        }
        writer.finish()?;
        Ok(bytes)
    };
    write_bytes(path, &encode().with_context(|| format!("encoding {}", path.display()))?)
}

/// The smallest rectangle [x, y, width, height] that contains all differences; one pixel if there are none.
fn changed(before: &[u8], after: &[u8], width: usize) -> [usize; 4] {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for (i, (a, b)) in before.chunks_exact(3).zip(after.chunks_exact(3)).enumerate() {
        if a != b {
            let place = [i % width, i / width];
            low = [low[0].min(place[0]), low[1].min(place[1])];
            high = [high[0].max(place[0]), high[1].max(place[1])];
        }
    }
    if low[0] > high[0] {
        return [0, 0, 1, 1];
    }
    [low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1]
}

/// The version for dark pages of an encoded picture, still or animated.
pub(crate) fn dark_png(bytes: &[u8], kept: &Kept) -> Result<Vec<u8>> {
    let mut dark = Vec::new();
    write_dark(&mut dark, bytes, kept)?;
    Ok(dark)
}

fn write_dark(dark: &mut Vec<u8>, bytes: &[u8], kept: &Kept) -> Result<()> {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info()?;
    let (width, height) = (reader.info().width, reader.info().height);
    let animation = reader.info().animation_control;
    let mut encoder = encoder_of(dark, [width, height]);
    let (color, depth) = reader.output_color_type();
    if (color, depth) != (png::ColorType::Rgb, png::BitDepth::Eight) {
        bail!("a picture of {color:?} and {depth:?}, not of three channels of eight bits");
    }
    if let Some(animation) = animation {
        encoder.set_animated(animation.num_frames, animation.num_plays)?;
    }
    let frames = animation.map_or(1, |animation| animation.num_frames);
    let size = reader.output_buffer_size().context("a picture too large for memory")?;
    let mut writer: Option<png::Writer<_>> = None;
    let mut encoder = Some(encoder);
    for _ in 0..frames {
        let mut pixels = vec![0; size];
        let shown = reader.next_frame(&mut pixels)?;
        pixels.truncate(shown.buffer_size());
        let control = reader.info().frame_control;
        let [x, y, w] = control.map_or([0, 0, width], |c| [c.x_offset, c.y_offset, c.width]);
        darkened(&mut pixels, [x, y, w], kept);
        if let Some(mut encoder) = encoder.take() {
            if let Some(control) = control {
                encoder.set_frame_delay(control.delay_num, control.delay_den)?;
            }
            writer = Some(encoder.write_header()?);
        } else if let (Some(writer), Some(control)) = (&mut writer, control) {
            // The position is checked against the size in force, so it is reset first.
            writer.reset_frame_position()?;
            writer.set_frame_dimension(control.width, control.height)?;
            writer.set_frame_position(control.x_offset, control.y_offset)?;
        }
        let Some(writer) = &mut writer else { bail!("a picture without a frame") };
        writer.write_image_data(&pixels)?;
    }
    if let Some(writer) = writer {
        writer.finish()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec2;

    use super::*;
    use crate::plot::{Color, dark, light};

    #[test]
    fn animations_repeat_and_store_changes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let frame = |x| {
            let mut canvas = Canvas::new(30.0, 20.0);
            canvas.disc(DVec2::new(x, 10.0), 3.0, Color::INK);
            canvas
        };
        let frames = [5.0, 5.0, 10.0, 10.0].map(frame);
        let last = light(&frames[3]);
        write_animation(&path, &frames, 40, light).unwrap();
        let file = std::io::BufReader::new(fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (4, 0));
        let mut shown = vec![0; last.len()];
        for _ in 0..4 {
            let mut part = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut part).unwrap();
            let place = *reader.info().frame_control.as_ref().unwrap();
            let (x, y, w, h) = (place.x_offset, place.y_offset, place.width as usize, place.height as usize);
            for row in 0..h {
                let start = 3 * ((y as usize + row) * 60 + x as usize);
                shown[start..start + 3 * w].copy_from_slice(&part[3 * row * w..][..3 * w]);
            }
        }
        assert_eq!(shown, last);
        assert!(write_animation(&path, &[], 40, light).is_err());
        let there = folder.path().join("b.png");
        write_animation(&there, &frames, 40, dark).unwrap();
        let made = dark_png(&fs::read(&path).unwrap(), frames[0].kept()).unwrap();
        assert_eq!(made, fs::read(&there).unwrap());
    }
}
