//! A network as the surface in a box.

use flatland::sdf::Jet;
use flatland::sdf::shapes::ShapeError;
use glam::DVec3;

use super::{Network, SingleNetwork};
use crate::sdf::BakeError;

/// Points along an edge of the box, and along one of its faces.
const INSIDE: usize = 17;
const FACE: usize = 9;

/// The boxes around it that are looked at, in multiples of its size.
const AROUND: [f64; 6] = [1.0, 1.5, 2.0, 4.0, 8.0, 16.0];

/// What the greatest slope that was found is multiplied by.
const MARGIN: f64 = 1.25;

/// Where the surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Within {
    /// The corners of the box.
    pub(super) bounds: (DVec3, DVec3),
    /// The least φ on its faces.
    pub(super) least: f64,
}

impl Network {
    /// The same network, whose surface lies between two corners, with a slope bound that was measured.
    ///
    /// φ must be positive at 9 × 9 points of each face of the box, and of boxes about it up to 16 times its size. The bound is 1.25
    /// times the greatest |∇φ| that was found outside of the surface at these points and 17³ in the box. Neither is a guarantee: between the points φ may do
    /// what it likes, and rays that find slopes above the bound are [counted](crate::scene::Scene::trace_counts). With other weights both are measured again.
    ///
    /// # Errors
    /// [`BakeError::Open`] where φ is not positive around the box, or not finite; [`BakeError::Network`] if the weights have no
    /// place in single precision, in which all this is measured.
    pub fn within(self, bounds: (DVec3, DVec3)) -> Result<Self, BakeError> {
        let single = SingleNetwork::new(&self)?;
        let around: Vec<DVec3> = AROUND.iter().flat_map(|&size| faces(bounds, size)).collect();
        let outside = single.jets(&around);
        for (&point, jet) in around.iter().zip(&outside) {
            if !(jet.value > 0.0 && jet.gradient.is_finite()) {
                return Err(BakeError::Open { point, value: jet.value });
            }
        }
        let inside = single.jets(&lattice(bounds, INSIDE).collect::<Vec<_>>());
        let seen = outside.iter().chain(&inside).filter(|jet| jet.value > 0.0);
        let steepest = seen.map(|jet| jet.gradient.length()).fold(0.0, f64::max);
        let on_faces = &outside[..6 * FACE * FACE];
        let least = on_faces.iter().map(|jet: &Jet<DVec3>| jet.value).fold(f64::INFINITY, f64::min);
        Ok(Self { within: Some(Within { bounds, least }), ..self.with_slope_bound(MARGIN * steepest)? })
    }

    /// The corners of the box [within](Self::within) which the surface is stated to lie.
    #[must_use]
    pub fn stated_bounds(&self) -> Option<(DVec3, DVec3)> {
        self.within.map(|within| within.bounds)
    }

    /// The same with other weights that were checked.
    pub(super) fn like(self, other: &Self) -> Result<Self, ShapeError> {
        let Some(Within { bounds, .. }) = other.within else {
            return Ok(Self { slope_bound: other.slope_bound, ..self });
        };
        self.within(bounds).map_err(|error| match error {
            BakeError::Network(error) => error,
            other => ShapeError::Unmade { shape: "network", reason: other.to_string() },
        })
    }
}

/// As many points along each axis, from face to face.
fn lattice((low, high): (DVec3, DVec3), count: usize) -> impl Iterator<Item = DVec3> {
    let part = move |i: usize| i as f64 / (count - 1) as f64;
    let place = move |i: usize| DVec3::new(part(i % count), part(i / count % count), part(i / count / count));
    (0..count.pow(3)).map(move |i| low + (high - low) * place(i))
}

/// The points of the six faces of a box of so many times the size.
fn faces((low, high): (DVec3, DVec3), size: f64) -> impl Iterator<Item = DVec3> {
    let (middle, half) = (0.5 * (low + high), 0.5 * size * (high - low));
    let part = |i: usize| 2.0 * i as f64 / (FACE - 1) as f64 - 1.0;
    (0..6 * FACE * FACE).map(move |i| {
        let (face, i) = (i / (FACE * FACE), i % (FACE * FACE));
        let mut way = DVec3::ZERO;
        way[face / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
        way[(face / 2 + 1) % 3] = part(i % FACE);
        way[(face / 2 + 2) % 3] = part(i / FACE);
        middle + half * way
    })
}

#[cfg(test)]
mod tests {
    use flatland::sdf::Sdf as _;
    use flatland::sdf::shapes::Parametric as _;

    use super::*;
    use crate::sdf::network::Architecture;

    fn ball() -> Network {
        let architecture = Architecture { hidden: 2, width: 32, sharpness: 100.0, frequencies: 0 };
        Network::sphere(architecture, 0.5, 3).expect("a network")
    }

    #[test]
    fn the_box_is_around_the_surface() {
        let corners = (DVec3::splat(-3.0), DVec3::splat(3.0));
        let network = ball().within(corners).expect("a surface in the box");
        assert_eq!(network.bounds(), Some(corners));
        assert_eq!((network.level_bounds(1e-3), network.level_bounds(90.0)), (Some(corners), None));
        let steepest = network.greatest_slope(&lattice(corners, 9).collect::<Vec<_>>());
        assert!(network.slope_bound() > steepest && network.slope_bound() < 2.0 * steepest);
        // All is measured again.
        let last = network.architecture().ranges(2).0.start;
        let mut twice = network.parameters();
        twice[last..].iter_mut().for_each(|weight| *weight *= 2.0);
        let twice = network.with_parameters(&twice).expect("the same surface");
        assert!((twice.slope_bound() / network.slope_bound() - 2.0).abs() < 1e-5);
        let mut larger = network.parameters();
        *larger.last_mut().expect("a bias") -= 9.0;
        let refused = network.with_parameters(&larger).expect_err("a surface that leaves the box");
        assert!(refused.to_string().contains("not within its box"), "{refused}");
    }

    #[test]
    fn a_box_that_the_surface_leaves_is_refused() {
        let (low, high) = (DVec3::splat(-3.0), DVec3::new(3.0, 0.1, 3.0));
        let error = ball().within((low, high)).expect_err("a surface beyond the box");
        let BakeError::Open { point, value } = error else { panic!("{error}") };
        assert!(value <= 0.0 && ball().value(point) <= 1e-5, "{value} at {point}");
        assert!(matches!(ball().within((DVec3::splat(f64::NAN), high)), Err(BakeError::Open { .. })));
    }
}
