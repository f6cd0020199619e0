//! Tangents of implicit surfaces: parameters and placement.

use flatland::sdf::{Jet, Sdf as _, SecondOrder};
use glam::DVec3;

use crate::scene::ImplicitShape;

/// Rates of an implicit surface; as the dual, its gradient.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImplicitTangent {
    /// Rates of its [parameters](flatland::sdf::shapes::Parametric::parameters).
    pub parameters: Vec<f64>,
    /// Velocity of its origin, scene units.
    pub translation: DVec3,
    /// Angular velocity about its origin, radians.
    pub rotation: DVec3,
}

impl ImplicitTangent {
    /// The zero tangent of a surface.
    #[must_use]
    pub fn still(shape: &ImplicitShape) -> Self {
        Self { parameters: vec![0.0; shape.surface.dimension()], ..Self::default() }
    }

    /// Adds a rotation about an axis through `centre`, right-handed, by |w| radians: ẋ = w × (x − c).
    pub fn rotate(&mut self, shape: &ImplicitShape, centre: DVec3, angular_velocity: DVec3) {
        self.rotation += angular_velocity;
        self.translation += angular_velocity.cross(shape.placement.translation - centre);
    }

    /// Whether all rates are zero.
    #[must_use]
    pub fn is_still(&self) -> bool {
        let Self { parameters, translation, rotation } = self;
        *translation == DVec3::ZERO && *rotation == DVec3::ZERO && parameters.iter().all(|p| *p == 0.0)
    }

    /// This change with ċ in place of θ̇: rates of the [coefficients](flatland::sdf::shapes::Parametric)
    /// from which φ is evaluated.
    pub(in crate::gradient) fn pushed_forward(&self, shape: &ImplicitShape) -> Self {
        Self { parameters: shape.surface.push_forward(&self.parameters), ..*self }
    }

    /// Transpose of [`pushed_forward`](Self::pushed_forward).
    pub(in crate::gradient) fn pulled_back(self, shape: &ImplicitShape) -> Self {
        Self { parameters: shape.surface.pull_back(self.parameters), ..self }
    }

    /// The zero gradient by the coefficients.
    pub(in crate::gradient) fn no_gradient(shape: &ImplicitShape) -> Self {
        Self { parameters: vec![0.0; shape.parameter_count()], ..Self::default() }
    }

    /// Sum of products of all rates.
    pub(in crate::gradient) fn dot(&self, other: &Self) -> f64 {
        let parameters = self.parameters.iter().zip(&other.parameters).map(|(a, b)| a * b).sum::<f64>();
        parameters + self.translation.dot(other.translation) + self.rotation.dot(other.rotation)
    }

    /// Adds another tangent.
    pub(in crate::gradient) fn add(&mut self, other: &Self) {
        self.parameters.iter_mut().zip(&other.parameters).for_each(|(a, b)| *a += b);
        self.translation += other.translation;
        self.rotation += other.rotation;
    }

    /// Adds `scale` times another tangent.
    pub(crate) fn add_scaled(&mut self, scale: f64, other: &Self) {
        self.parameters.iter_mut().zip(&other.parameters).for_each(|(a, b)| *a += scale * b);
        self.translation += scale * other.translation;
        self.rotation += scale * other.rotation;
    }

    /// φ̇ and ∇φ̇ at x, for a change that is [pushed forward](Self::pushed_forward) and given φ to second
    /// order. With u = v + w × (x − p), the rigid motion contributes −∇φ·u and −∇²φ u + w × ∇φ.
    pub(in crate::gradient) fn rate(
        &self,
        shape: &ImplicitShape,
        x: DVec3,
        there: &SecondOrder<DVec3>,
    ) -> Jet<DVec3> {
        let (v, w) = (self.translation, self.rotation);
        let moved = there.advected(v + w.cross(x - shape.placement.translation));
        let turned = w.cross(there.jet.gradient);
        shape.rate(x, &self.parameters) + Jet { value: -moved.value, gradient: turned - moved.gradient }
    }

    /// Transpose of [`rate`](Self::rate) for the rigid motion: adds the part of a covector of (φ̇, ∇φ̇) at x.
    pub(in crate::gradient) fn scatter_motion(
        &mut self,
        shape: &ImplicitShape,
        x: DVec3,
        there: &SecondOrder<DVec3>,
        covector: Jet<DVec3>,
    ) {
        let c = there.advected_transpose(covector);
        self.translation -= c;
        self.rotation +=
            there.jet.gradient.cross(covector.gradient) - (x - shape.placement.translation).cross(c);
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::scene::{ImplicitSurface, Placement};
    use crate::sdf::analytic::RoundedBox;

    fn shape() -> ImplicitShape {
        let (centre, half) = (DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.9, 0.5, 0.4));
        let surface = RoundedBox::new(centre, half, 0.15).expect("a box");
        let rotation = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 1.1);
        let placement = Placement { scale: 1.7, rotation, translation: DVec3::new(0.4, 0.2, -0.6) };
        ImplicitShape { id: "box".into(), surface: ImplicitSurface::new(surface), placement, material: 0 }
    }

    fn tangent(shape: &ImplicitShape) -> ImplicitTangent {
        let parameters = (0..shape.parameter_count()).map(|i| (i as f64 * 1.3).sin()).collect();
        let (translation, rotation) = (DVec3::new(0.3, -0.5, 0.2), DVec3::new(-0.4, 0.7, 0.9));
        ImplicitTangent { parameters, translation, rotation }
    }

    #[test]
    fn rates_are_those_of_the_displaced_surface() {
        let shape = shape();
        let change = tangent(&shape);
        let h = 1e-6;
        let at = |h: f64| change.displaced(&shape, h).expect("it stays a box");
        for x in [DVec3::new(2.0, 1.0, 0.3), DVec3::new(-1.5, 0.2, 1.4), DVec3::new(0.1, -1.9, -1.0)] {
            let rate = change.rate(&shape, x, &shape.second_order(x));
            let (after, before) = (at(h).jet(x), at(-h).jet(x));
            let value = (after.value - before.value) / (2.0 * h);
            let gradient = (after.gradient - before.gradient) / (2.0 * h);
            assert!((rate.value - value).abs() < 1e-8, "{} {value}", rate.value);
            assert!(rate.gradient.distance(gradient) < 1e-7, "{} {gradient}", rate.gradient);
        }
    }

    #[test]
    fn a_turn_moves_no_point_of_its_axis() {
        let shape = shape();
        let mut change = ImplicitTangent::still(&shape);
        let (centre, axis) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.2, 0.4, -0.1));
        change.rotate(&shape, centre, axis);
        for along in [-1.0, 0.0, 2.5] {
            let x = centre + along * axis;
            let rate = change.rate(&shape, x, &shape.second_order(x));
            assert!(rate.value.abs() < 1e-14, "{}", rate.value);
        }
    }

    #[test]
    fn the_transpose_is_one() {
        let shape = shape();
        let change = tangent(&shape);
        let x = DVec3::new(1.5, 1.0, 0.3);
        let there = shape.second_order(x);
        let covector = Jet { value: 0.7, gradient: DVec3::new(-0.2, 1.1, 0.6) };
        let mut gradient = ImplicitTangent::still(&shape);
        gradient.scatter_motion(&shape, x, &there, covector);
        shape.add_parameter_gradient(x, covector, &mut gradient.parameters);
        let (forward, reverse) = (change.rate(&shape, x, &there).dot(covector), gradient.dot(&change));
        assert!((forward - reverse).abs() < 1e-13, "{forward} {reverse}");
    }
}
