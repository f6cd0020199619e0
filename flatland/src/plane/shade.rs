//! Shades: the colour of a polygon as a function of position.

use glam::{DMat2, DVec2, DVec3};

use crate::calculus::{Dual, Number};

/// Attachment of a shade when its polygon moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Attachment {
    /// Fixed to the image plane: the polygon is a moving window onto it, and ∂f/∂θ = 0 inside.
    #[default]
    Image,
    /// Carried by the material: ∂f/∂θ = −∇f·v inside, with v the material's velocity.
    Material,
}

/// Invalid parameters of a shade.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShadeError {
    /// A coefficient is NaN or infinite.
    #[error("shade has a coefficient that is not finite: {what}")]
    NotFinite {
        /// Name of the coefficient.
        what: &'static str,
    },
    /// Ramp stops must increase: equal offsets would be a discontinuity inside the polygon.
    #[error("ramp stop {index} does not lie after stop {}: offsets must increase strictly", index - 1)]
    StopsNotIncreasing {
        /// Index of the later stop of the pair.
        index: usize,
    },
    /// A ramp needs at least one stop.
    #[error("ramp has no stops")]
    NoStops,
}

/// The colour f(u) of a polygon: linear RGB, each channel polynomial or piecewise linear in u.
#[derive(Clone, Debug, PartialEq)]
pub struct Shade {
    profile: Profile,
    attachment: Attachment,
}

#[derive(Clone, Debug, PartialEq)]
enum Profile {
    /// c + G (u − o) + ½ (u − o)ᵀ H (u − o), with G and H per channel; the anchor o keeps it
    /// accurate far from the origin.
    Polynomial { anchor: DVec2, value: DVec3, gradient: [DVec2; 3], hessian: [DMat2; 3] },
    /// Piecewise linear in t = (u − o)·d between stops, constant beyond them.
    Ramp { anchor: DVec2, direction: DVec2, stops: Vec<(f64, DVec3)> },
}

impl Shade {
    /// A constant colour.
    #[must_use]
    pub fn constant(value: DVec3) -> Self {
        let profile = Profile::Polynomial {
            anchor: DVec2::ZERO,
            value,
            gradient: [DVec2::ZERO; 3],
            hessian: [DMat2::ZERO; 3],
        };
        Self { profile, attachment: Attachment::Image }
    }

    /// value + gradient (u − anchor), one gradient per channel, in colour per unit length.
    #[must_use]
    pub fn linear(anchor: DVec2, value: DVec3, gradient: [DVec2; 3], attachment: Attachment) -> Self {
        Self::quadratic(anchor, value, gradient, [DMat2::ZERO; 3], attachment)
    }

    /// value + gradient (u − anchor) + ½ (u − anchor)ᵀ hessian (u − anchor), per channel. Only the
    /// symmetric part of a Hessian matters.
    #[must_use]
    pub fn quadratic(
        anchor: DVec2,
        value: DVec3,
        gradient: [DVec2; 3],
        hessian: [DMat2; 3],
        attachment: Attachment,
    ) -> Self {
        let hessian = hessian.map(|h| (h + h.transpose()) * 0.5);
        Self { profile: Profile::Polynomial { anchor, value, gradient, hessian }, attachment }
    }

    /// A linear gradient as in SVG: colours at increasing offsets along t = (u − anchor)·direction,
    /// linear between them and constant beyond (`spreadMethod="pad"`). The direction is
    /// (end − start)/|end − start|² when offsets run from 0 at the start to 1 at the end.
    ///
    /// # Errors
    /// [`ShadeError::NoStops`], [`ShadeError::StopsNotIncreasing`] or [`ShadeError::NotFinite`].
    pub fn ramp(
        anchor: DVec2,
        direction: DVec2,
        stops: Vec<(f64, DVec3)>,
        attachment: Attachment,
    ) -> Result<Self, ShadeError> {
        if stops.is_empty() {
            return Err(ShadeError::NoStops);
        }
        if let Some(index) = (1..stops.len()).find(|&i| stops[i].0 <= stops[i - 1].0) {
            return Err(ShadeError::StopsNotIncreasing { index });
        }
        let shade = Self { profile: Profile::Ramp { anchor, direction, stops }, attachment };
        shade.check().map(|()| shade)
    }

    /// The shade's attachment.
    #[must_use]
    pub fn attachment(&self) -> Attachment {
        self.attachment
    }

    /// f(u).
    #[must_use]
    pub fn value(&self, u: DVec2) -> DVec3 {
        match &self.profile {
            Profile::Polynomial { anchor, value, gradient, hessian } => {
                let d = u - anchor;
                *value + per_channel(|c| (gradient[c] + 0.5 * (hessian[c] * d)).dot(d))
            }
            Profile::Ramp { anchor, direction, stops } => {
                let t = (u - anchor).dot(*direction);
                let next = stops.partition_point(|s| s.0 <= t);
                match (next.checked_sub(1).map(|i| stops[i]), stops.get(next)) {
                    (Some((t0, c0)), Some(&(t1, c1))) => c0.lerp(c1, (t - t0) / (t1 - t0)),
                    (Some((_, c)), None) | (None, Some(&(_, c))) => c,
                    (None, None) => unreachable!("a ramp has a stop"),
                }
            }
        }
    }

    /// ∇f(u), one row per channel. At a ramp's stop it is the gradient on the side of larger t.
    #[must_use]
    pub fn gradient(&self, u: DVec2) -> [DVec2; 3] {
        match &self.profile {
            Profile::Polynomial { anchor, gradient, hessian, .. } => {
                let d = u - anchor;
                std::array::from_fn(|c| gradient[c] + hessian[c] * d)
            }
            Profile::Ramp { anchor, direction, stops } => {
                let t = (u - anchor).dot(*direction);
                let next = stops.partition_point(|s| s.0 <= t);
                if next == 0 || next == stops.len() {
                    return [DVec2::ZERO; 3];
                }
                let ((t0, c0), (t1, c1)) = (stops[next - 1], stops[next]);
                let slope = (c1 - c0) / (t1 - t0);
                slope.to_array().map(|s| s * *direction)
            }
        }
    }

    /// The lines (point, normal) across which the shade is continuous but not smooth. Exact
    /// quadrature must not straddle them.
    pub(crate) fn creases(&self) -> Vec<(DVec2, DVec2)> {
        match &self.profile {
            Profile::Polynomial { .. } => vec![],
            Profile::Ramp { anchor, direction, stops } => {
                let squared = direction.length_squared();
                if squared == 0.0 {
                    return vec![];
                }
                stops.iter().map(|(t, _)| (*anchor + *direction * (t / squared), *direction)).collect()
            }
        }
    }

    /// Whether f is constant, so that its gradient is 0.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match &self.profile {
            Profile::Polynomial { gradient, hessian, .. } => {
                *gradient == [DVec2::ZERO; 3] && *hessian == [DMat2::ZERO; 3]
            }
            Profile::Ramp { stops, .. } => stops.len() == 1,
        }
    }

    /// Whether a nonconstant shade is carried by the material, so that ∂f/∂θ may be nonzero.
    #[must_use]
    pub(crate) fn is_carried(&self) -> bool {
        self.attachment == Attachment::Material && !self.is_constant()
    }

    /// f along a path.
    pub(crate) fn value_dual(&self, u: [Dual<1>; 2]) -> [Dual<1>; 3] {
        let from = |anchor: &DVec2| [u[0] - Dual::constant(anchor.x), u[1] - Dual::constant(anchor.y)];
        match &self.profile {
            Profile::Polynomial { anchor, value, gradient, hessian } => {
                let [x, y] = from(anchor);
                std::array::from_fn(|c| {
                    let (g, h) = (gradient[c], hessian[c]);
                    let quadratic = x * x * h.x_axis.x + x * y * (2.0 * h.x_axis.y) + y * y * h.y_axis.y;
                    Dual::constant(value[c]) + x * g.x + y * g.y + quadratic * 0.5
                })
            }
            Profile::Ramp { anchor, direction, stops } => {
                let [x, y] = from(anchor);
                let t = x * direction.x + y * direction.y;
                let next = stops.partition_point(|s| s.0 <= t.value);
                if next == 0 || next == stops.len() {
                    let end = stops[next.saturating_sub(1)].1;
                    return end.to_array().map(Dual::constant);
                }
                let ((t0, c0), (t1, c1)) = (stops[next - 1], stops[next]);
                let s = (t - Dual::constant(t0)) * (1.0 / (t1 - t0));
                std::array::from_fn(|c| Dual::constant(c0[c]) + s * (c1[c] - c0[c]))
            }
        }
    }

    pub(crate) fn check(&self) -> Result<(), ShadeError> {
        let finite = |ok: bool, what| if ok { Ok(()) } else { Err(ShadeError::NotFinite { what }) };
        match &self.profile {
            Profile::Polynomial { anchor, value, gradient, hessian } => {
                finite(anchor.is_finite(), "anchor")?;
                finite(value.is_finite(), "value")?;
                finite(gradient.iter().all(|g| g.is_finite()), "gradient")?;
                finite(hessian.iter().all(DMat2::is_finite), "hessian")
            }
            Profile::Ramp { anchor, direction, stops } => {
                finite(anchor.is_finite(), "anchor")?;
                finite(direction.is_finite(), "direction")?;
                finite(stops.iter().all(|(t, c)| t.is_finite() && c.is_finite()), "stop")
            }
        }
    }
}

fn per_channel(f: impl Fn(usize) -> f64) -> DVec3 {
    DVec3::new(f(0), f(1), f(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_is_the_derivative_of_the_value() {
        let h = DMat2::from_cols_array(&[0.3, -0.2, 0.4, 0.1]);
        let quadratic = Shade::quadratic(
            DVec2::new(1.0, -2.0),
            DVec3::new(0.1, 0.2, 0.3),
            [DVec2::X, DVec2::Y, DVec2::new(0.5, -0.5)],
            [h, -h, h * 2.0],
            Attachment::Image,
        );
        let stops = vec![(0.0, DVec3::X), (0.5, DVec3::Y), (1.0, DVec3::ONE)];
        let ramp = Shade::ramp(DVec2::ZERO, DVec2::new(0.4, 0.2), stops, Attachment::Image).unwrap();
        for shade in [quadratic, ramp] {
            for u in [DVec2::new(0.3, 0.2), DVec2::new(1.4, 0.7), DVec2::new(-3.0, 9.0)] {
                let step = 1e-6;
                let g = shade.gradient(u);
                for axis in [DVec2::X, DVec2::Y] {
                    let fd = (shade.value(u + step * axis) - shade.value(u - step * axis)) / (2.0 * step);
                    for c in 0..3 {
                        assert!((g[c].dot(axis) - fd[c]).abs() < 1e-8, "{u} {c}");
                    }
                }
            }
        }
    }

    #[test]
    fn bad_ramps_are_refused() {
        let ramp = |stops| Shade::ramp(DVec2::ZERO, DVec2::X, stops, Attachment::Image);
        assert_eq!(ramp(vec![]), Err(ShadeError::NoStops));
        let equal = vec![(0.5, DVec3::ZERO), (0.5, DVec3::ONE)];
        assert_eq!(ramp(equal), Err(ShadeError::StopsNotIncreasing { index: 1 }));
        assert_eq!(ramp(vec![(0.0, DVec3::NAN)]), Err(ShadeError::NotFinite { what: "stop" }));
    }
}
