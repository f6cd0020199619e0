//! Participating media.

use glam::DVec3;

/// A homogeneous absorbing and scattering medium. Along a straight line with arc length t
///
/// ```text
/// dL/dt = −σ L + σ α ∫ p(ω·ω′) L(ω′) dω′,
/// ```
///
/// per channel, with the phase function p of Henyey and Greenstein (Chandrasekhar 1960; Pharr, Jakob and
/// Humphreys 2023, chapter 11). It does not emit. Images and finite differences support media; all other
/// derivatives refuse scenes with any ([`Unsupported::Medium`](crate::gradient::Unsupported::Medium)).
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Name in messages.
    pub id: String,
    /// σ, the extinction coefficient (absorption and scattering), per world unit of length; at least 0.
    pub extinction: DVec3,
    /// α, the scattering fraction of the extinction, in [0, 1].
    pub albedo: DVec3,
    /// g, the mean cosine of the scattering angle, in (−1, 1): 0 is isotropic, 0.9 typical of fog or milk.
    pub asymmetry: f64,
}

/// The media that a surface separates, by index; `None` for empty space. A path that leaves the surface
/// continues in the medium of the side to which it leaves, independently of the medium it came through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boundary {
    /// Medium behind the front.
    pub interior: Option<usize>,
    /// Medium in front of it.
    pub exterior: Option<usize>,
}

impl Medium {
    /// Transmittance e^{−σ t} over a length t, by channel; t may be infinite.
    #[must_use]
    pub fn transmittance(&self, length: f64) -> DVec3 {
        // 0 times infinity is 0 here.
        self.extinction.map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * length).exp() })
    }

    /// Whether it scatters light.
    pub(crate) fn scatters(&self) -> bool {
        (self.extinction * self.albedo).max_element() > 0.0
    }
}
