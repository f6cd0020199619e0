//! What fills the space between surfaces.

use glam::DVec3;

/// A homogeneous medium, which absorbs and scatters light along its way. Along a straight way of length t in it
///
/// ```text
/// dL/dt = −σ L + σ α ∫ p(ω·ω′) L(ω′) dω′,
/// ```
///
/// by channel, with the phase function p of Henyey and Greenstein (Chandrasekhar 1960; Pharr, Jakob and Humphreys 2023,
/// chapter 11). It emits nothing. Images see media, and so do finite differences; every other derivative refuses scenes with
/// any ([`Unsupported::Medium`](crate::gradient::Unsupported::Medium)).
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Its name in messages.
    pub id: String,
    /// σ, what is lost of a ray by absorption and scattering, per unit of length in the world; at least 0.
    pub extinction: DVec3,
    /// α, the scattered part of what is lost, in [0, 1].
    pub albedo: DVec3,
    /// g, the mean cosine of the angle by which light turns when it is scattered, in (−1, 1): 0 is scattering alike in all
    /// directions, and 0.9 that of fog or milk.
    pub asymmetry: f64,
}

/// The media that a surface separates, by their indices in the scene; nothing is empty space. A path that leaves the surface
/// goes on in the medium of the side to which it leaves, whatever it came through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boundary {
    /// Behind the front.
    pub interior: Option<usize>,
    /// Before it.
    pub exterior: Option<usize>,
}

impl Medium {
    /// e^{−σ t}, the part of light that gets through a length t of it by channel; t may be infinite.
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
