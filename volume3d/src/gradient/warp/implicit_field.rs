//! Warp fields for the silhouettes of implicit surfaces.

use flatland::sdf::fields::{BangaruField, FieldError, TracedField, ViciniField};

use crate::Sphere;

/// Weights of sphere-tracing points in the mean over discontinuities: how silhouettes of implicit surfaces
/// enter the field.
///
/// Let G = −φ̇ ∇φ/|∇φ|² be the velocity of the level sets at the tracer's points x_i = x + t_i u, ∫ K and ∫ ḃ
/// K the integrals over mesh edges (see [`Field::JumpMean`](crate::gradient::Field::JumpMean)), and c₀ their
/// floor, 2π divided by their reach. Then
///
/// > V = (∫ ḃ K + Σ κ_i G_i/t_i) / (∫ K + Σ κ_i + c₀),
///
/// where Σ κ diverges at silhouettes of its own surface and is finite at those of others: at any silhouette V
/// equals that silhouette's velocity.
///
/// Neither variant supports corners, or grids whose ∇φ is discontinuous between cells, and both are biased by
/// the tracer's [tolerance](crate::scene::Description::tracer). [Auxiliary
/// rays](crate::gradient::Field::AuxiliaryRays) follow implicit surfaces without either limitation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImplicitField {
    /// One point per ray, the mean of the tracer's points with the weights of Vicini et al. (2022). The
    /// default: fewest evaluations of φ, and the least variance of those tried.
    ///
    /// κ = c₀ (c/r − 1)₊, with r = |φ|/t at that point approximating the angle to the silhouette; without
    /// meshes, V = (1 − r/c)₊ G/t.
    Vicini {
        /// c, in radians: distance from a silhouette within which V is nonzero. Default 0.1; the paper's
        /// value 0.01 had three times the variance on a ball.
        reach: f64,
    },
    /// All points of the tracer, with the weights of Bangaru et al. (2022), in angles and not normalised, so
    /// that several surfaces and edges share one mean.
    ///
    /// κ_i = (ℓ_i/t_i) (S_i/t_i)^−γ, S = |φ| + λ s |∇φ·u|, with ℓ_i the step from x_i and s the size of the
    /// surface, half the diagonal of its box. Rates of φ are evaluated at every point of a ray, for Vicini's
    /// field at one. On a bunny on a 64-cell grid a gradient took 2.4 times the processor time; the variance
    /// was 2.0 and 2.5 times the default's for a union that shades itself and for a ball over a floor.
    Bangaru {
        /// γ: 3 in the paper, which found values above 6 unstable. Above 2, V approaches a silhouette's
        /// velocity at least as fast as its distance to the silhouette.
        gamma: f64,
        /// λ, about 0.1. Smaller values average over longer pieces of the ray.
        lambda: f64,
        /// Number (at least 2) of points with the least S_i/t_i that count, the last of which has its weight
        /// subtracted from all, as in the paper; `None` for all points. **Discontinuous**, hence biased:
        /// where a ray begins to hit, a new point with zero step length and small S enters and shifts all
        /// ranks. For comparison only.
        nearest: Option<usize>,
    },
}

impl Default for ImplicitField {
    fn default() -> Self {
        Self::Vicini { reach: 0.1 }
    }
}

impl ImplicitField {
    /// The field of Bangaru et al. (2022) with γ = 3, λ = 0.1 and all points.
    #[must_use]
    pub fn bangaru() -> Self {
        Self::Bangaru { gamma: 3.0, lambda: 0.1, nearest: None }
    }

    /// Weights for a surface of the given size, and for rays that leave it or not.
    pub(in crate::gradient) fn weights(self, size: f64, leaves: bool) -> Weights {
        // On rays that leave the surface, points nearer than about this carry little information about its
        // silhouettes.
        let departure = if leaves { 0.2 * size } else { 0.0 };
        match self {
            Self::Vicini { reach } => Weights::Vicini(ViciniField {
                epsilon: 1e-6 * size,
                grazing: 0.05 * size,
                gamma: 3.0,
                reach: Some(reach),
                departure,
            }),
            Self::Bangaru { gamma, lambda, nearest } => {
                Weights::Bangaru(BangaruField { gamma, lambda: lambda * size, keep: nearest, departure })
            }
        }
    }

    /// Refuses invalid parameters.
    pub(in crate::gradient) fn check(self) -> Result<(), FieldError> {
        match self.weights(1.0, false) {
            Weights::Vicini(field) => TracedField::<Sphere>::check(&field),
            Weights::Bangaru(field) => TracedField::<Sphere>::check(&field),
        }
    }
}

/// Weights of the tracer's points at one surface, in units of its size, so that derivatives do not depend on
/// the unit of length.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) enum Weights {
    Vicini(ViciniField),
    Bangaru(BangaruField),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::tests::scenes::square;
    use crate::gradient::{GradientError, Progress, Tangent, WarpedArea};
    use crate::scene::Filter;

    #[test]
    fn parameters_that_make_no_field_are_refused() {
        let bangaru = |gamma, lambda, nearest| ImplicitField::Bangaru { gamma, lambda, nearest };
        let scene = square(Filter::Box);
        let run = |implicit| {
            let method = WarpedArea { samples: 1, implicit, ..WarpedArea::default() };
            method.forward(&scene, &Tangent::still(&scene), &Progress::none()).map(|_| ())
        };
        for good in [ImplicitField::default(), ImplicitField::bangaru(), bangaru(2.5, 0.0, Some(2))] {
            assert_eq!(run(good), Ok(()));
        }
        let bad = [
            ImplicitField::Vicini { reach: 0.0 },
            ImplicitField::Vicini { reach: f64::NAN },
            bangaru(0.0, 0.1, None),
            bangaru(3.0, -0.1, None),
            bangaru(3.0, 0.1, Some(1)),
        ];
        for bad in bad {
            assert!(matches!(run(bad), Err(GradientError::ImplicitField(_))), "{bad:?}");
        }
    }
}
