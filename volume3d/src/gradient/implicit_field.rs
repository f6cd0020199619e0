//! Which field follows the silhouettes of implicit surfaces.

use flatland::sdf::fields::{BangaruField, FieldError, TracedField, ViciniField};

use crate::Sphere;

/// The field of implicit surfaces within the mean over jumps: what of a ray's sphere tracer stands for the silhouettes near it.
///
/// With G = −φ̇ ∇φ/|∇φ|² the velocity of the level sets at the points x_i = x + t_i u of the tracer, ∫ K and ∫ ḃ K the
/// integrals over the edges of meshes (see [`Field::JumpMean`](super::Field::JumpMean)), and c₀ their floor, 2π over their reach,
///
/// > V = (∫ ḃ K + Σ κ_i G_i/t_i) / (∫ K + Σ κ_i + c₀),
///
/// where Σ κ grows without bound at the silhouettes of its surface, and is finite at those of others: V is the velocity of
/// whichever silhouette is at u, and follows them all.
///
/// Neither takes corners, or grids whose ∇φ jumps between cells, and both are biased by the tracer's
/// [tolerance](crate::scene::Description::tracer). [Auxiliary rays](super::Field::AuxiliaryRays) follow implicit surfaces without either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImplicitField {
    /// One point of the ray, the mean of the tracer's points with the weights of Vicini et al. (2022), the default: it takes
    /// the fewest looks at φ, and its variance was the least of those tried.
    ///
    /// κ = c₀ (c/r − 1)₊, with r = |φ|/t there, about the angle to the silhouette: alone, V = (1 − r/c)₊ G/t.
    Vicini {
        /// c, in radians: how far from a silhouette V is not 0. 0.1 unless there is a reason; 0.01 is what the paper has, with three
        /// times the variance on a ball.
        reach: f64,
    },
    /// All points of the tracer, with the weights of Bangaru et al. (2022), in angles and not normalised, so that those of several
    /// surfaces and of edges make one mean.
    ///
    /// κ_i = (ℓ_i/t_i) (S_i/t_i)^−γ, S = |φ| + λ s |∇φ·u|, with ℓ_i the step from x_i and s the size of the surface, half the
    /// diagonal of its box. It looks at the rates of φ at every point of a ray, where
    /// Vicini's field looks at one: the gradient of a bunny on a grid of 64 cells took 2.4 times the processor time, and variances were 2.0 and 2.5
    /// times those of the default for a union that shades itself and for a ball over a floor. Neither showed a bias there, of which
    /// 1.2 % would have been two standard errors.
    Bangaru {
        /// γ: 3 in the paper, which found more than 6 unstable. Above 2 for V to be as near to a silhouette's velocity as it is to the silhouette.
        gamma: f64,
        /// λ: about 0.1. Smaller ones average over longer pieces of the ray.
        lambda: f64,
        /// Only the points with so many of the least S_i/t_i count, at least 2, whose last has its weight subtracted from
        /// all, as in the paper; `None` for all. **Not continuous**, and so biased: a point that comes in where a ray hits has no
        /// length and a small S, and shifts all ranks. For comparison.
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

    /// The weights for a surface of so large a size, and for rays that leave it or do not.
    pub(super) fn weights(self, size: f64, leaves: bool) -> Weights {
        // Of rays that leave the surface, the points nearer than about this say little of its silhouettes.
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

    /// Refuses parameters that make no field.
    pub(super) fn check(self) -> Result<(), FieldError> {
        match self.weights(1.0, false) {
            Weights::Vicini(field) => TracedField::<Sphere>::check(&field),
            Weights::Bangaru(field) => TracedField::<Sphere>::check(&field),
        }
    }
}

/// The weights of the tracer's points at one surface, in its units: images do not depend on units of length, and neither do
/// their derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) enum Weights {
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
