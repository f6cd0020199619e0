//! Conversion of paints to shades.

use glam::{DAffine2, DMat2, DVec2, DVec3};
use usvg::{LinearGradient, Paint, SpreadMethod, Transform};

use super::super::{Attachment, Shade, ShadeError};

/// Stops closer than this are merged: usvg moves equal offsets apart by 2⁻²³.
const SAME_OFFSET: f64 = 1e-6;

/// Reason why a paint is not a shade.
pub(super) enum PaintError {
    /// Not representable in a scene.
    Unsupported(&'static str),
    /// Not well defined.
    Shade(ShadeError),
}

/// The colours of a paint in the image, for a path with the given transform.
pub(super) fn shade(
    paint: &Paint,
    transform: Transform,
    attachment: Attachment,
) -> Result<Shade, PaintError> {
    match paint {
        Paint::Color(c) => Ok(Shade::constant(colour(*c))),
        Paint::LinearGradient(gradient) => ramp(gradient, transform, attachment),
        Paint::RadialGradient(_) => Err(PaintError::Unsupported("radialGradient")),
        Paint::Pattern(_) => Err(PaintError::Unsupported("pattern")),
    }
}

fn ramp(
    gradient: &LinearGradient,
    transform: Transform,
    attachment: Attachment,
) -> Result<Shade, PaintError> {
    if gradient.spread_method() != SpreadMethod::Pad {
        return Err(PaintError::Unsupported("a spreadMethod other than pad"));
    }
    let mut stops: Vec<(f64, DVec3)> = vec![];
    for stop in gradient.stops() {
        if stop.opacity().get() < 1.0 {
            return Err(PaintError::Unsupported("stop-opacity below 1"));
        }
        let (offset, value) = (f64::from(stop.offset().get()), colour(stop.color()));
        match stops.last() {
            Some(&(last, before)) if offset - last < SAME_OFFSET => {
                if value != before {
                    return Err(PaintError::Unsupported("a gradient with two colours at one offset"));
                }
            }
            _ => stops.push((offset, value)),
        }
    }
    let Some(&(_, last)) = stops.last() else {
        return Err(PaintError::Shade(ShadeError::NoStops));
    };
    let [x1, y1, x2, y2] = [gradient.x1(), gradient.y1(), gradient.x2(), gradient.y2()].map(f64::from);
    let (start, along) = (DVec2::new(x1, y1), DVec2::new(x2 - x1, y2 - y1));
    let squared = along.length_squared();
    if squared == 0.0 || stops.iter().all(|(_, c)| *c == last) {
        // SVG: a gradient vector without length paints the last colour.
        return Ok(Shade::constant(last));
    }
    let to_image = affine(transform) * affine(gradient.transform());
    // Singular, or overflow in its computation.
    if !to_image.matrix2.inverse().is_finite() {
        return Err(PaintError::Unsupported("a gradient whose transform has no inverse"));
    }
    let direction = to_image.matrix2.inverse().transpose() * (along / squared);
    let anchor = to_image.transform_point2(start);
    Shade::ramp(anchor, direction, stops, attachment).map_err(PaintError::Shade)
}

fn affine(t: Transform) -> DAffine2 {
    let [sx, ky, kx, sy, tx, ty] = [t.sx, t.ky, t.kx, t.sy, t.tx, t.ty].map(f64::from);
    DAffine2::from_mat2_translation(
        DMat2::from_cols(DVec2::new(sx, ky), DVec2::new(kx, sy)),
        DVec2::new(tx, ty),
    )
}

fn colour(c: usvg::Color) -> DVec3 {
    DVec3::new(f64::from(c.red), f64::from(c.green), f64::from(c.blue)) / 255.0
}
