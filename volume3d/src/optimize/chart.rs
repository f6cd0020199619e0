//! Local coordinates of the parameters, for methods that add vectors.

use glam::DVec3;

use super::parameters::Parameters;

/// Local coordinates y of parameters relative to an origin x₀: x = [`retract`](Parameters::retract)(x₀, y).
///
/// Methods such as [`lbfgs`](super::lbfgs()) add steps and subtract gradients, which is not valid for
/// rotations: R₁ R₂ is not the rotation by the sum of two vectors, and [`Parameters::gradient`] is the
/// derivative by a further turn δ of the current rotation, exp(δ) R. In a chart R = exp(y) R₀, where y is an
/// ordinary vector, and the derivative by it is
///
/// ```text
/// ∂L/∂y = Jₗ(y)ᵀ ∂L/∂δ,   exp(y + dy) = exp(Jₗ(y) dy) exp(y),
/// Jₗ(y) = I + (1 − cos θ)/θ² [y]ₓ + (θ − sin θ)/θ³ [y]ₓ²,   θ = |y|,
/// ```
///
/// with the left Jacobian of SO(3) (Barfoot 2017, equation 7.77). All other parameters are x₀ + y, with the
/// same derivative.
///
/// A chart is valid for turns of less than a full one, where Jₗ is singular; beyond half a turn, make a new
/// chart at the current parameters.
#[derive(Clone, Debug)]
pub struct Chart<'p> {
    parameters: &'p Parameters,
    origin: Vec<f64>,
}

impl<'p> Chart<'p> {
    /// The chart around `origin`, which has y = 0.
    ///
    /// # Panics
    /// If `origin` has another length than the parameters.
    #[must_use]
    pub fn new(parameters: &'p Parameters, origin: &[f64]) -> Self {
        assert_eq!(origin.len(), parameters.len(), "one number for each parameter");
        Self { parameters, origin: origin.to_vec() }
    }

    /// The parameters x with coordinates y.
    ///
    /// # Panics
    /// If y has another length than the parameters.
    #[must_use]
    pub fn point(&self, y: &[f64]) -> Vec<f64> {
        let mut x = self.origin.clone();
        self.parameters.retract(&mut x, y);
        x
    }

    /// The derivative by y from that of [`Parameters::gradient`] at [`point`](Self::point)(y). y must be
    /// within [`bounds`](Self::bounds), because beyond them x does not change.
    ///
    /// # Panics
    /// If the lengths are not that of the parameters.
    #[must_use]
    pub fn gradient(&self, y: &[f64], gradient: &[f64]) -> Vec<f64> {
        assert_eq!([y.len(), gradient.len()], [self.origin.len(); 2], "one number for each parameter");
        let mut pulled = gradient.to_vec();
        for group in self.parameters.groups().iter().filter(|g| g.turns()) {
            let [y, g] = [y, gradient].map(|v| DVec3::from_slice(&v[group.range.clone()]));
            pulled[group.range.clone()].copy_from_slice(&left_jacobian_transposed(y, g).to_array());
        }
        pulled
    }

    /// Lower and upper bound of each number of y: those of the parameters, and half a turn either way for
    /// rotations.
    #[must_use]
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let of = |group: &super::Group| {
            let (bounds, turns) = (group.bounds, group.turns());
            let half = [-std::f64::consts::PI, std::f64::consts::PI];
            let relative = move |x: &f64| if turns { half } else { bounds.map(|b| b - x) };
            self.origin[group.range.clone()].iter().map(relative).collect::<Vec<_>>()
        };
        self.parameters.groups().iter().flat_map(of).collect()
    }
}

/// Jₗ(y)ᵀ g.
fn left_jacobian_transposed(y: DVec3, g: DVec3) -> DVec3 {
    let angle = y.length();
    // Below, the next terms of the series are less than rounding.
    let (a, b) = if angle < 1e-3 {
        let square = angle * angle;
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        // 1 − cos θ = 2 sin²(θ/2), without cancellation.
        let half = (0.5 * angle).sin() / angle;
        (2.0 * half * half, (angle - angle.sin()) / (angle * angle * angle))
    };
    g - a * y.cross(g) + b * y.cross(y.cross(g))
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::pose::rotation_vector;
    use super::*;
    use crate::scene::{Camera, Description, Film, Filter, Material, Scene};

    #[test]
    fn the_left_jacobian_is_that_of_central_differences() {
        let g = DVec3::new(0.3, -0.7, 0.5);
        let about = DVec3::new(0.6, -0.3, 0.8).normalize();
        for angle in [0.0, 1e-6, 0.99e-3, 1.01e-3, 0.3, 2.0, 3.1, 5.0] {
            let y = angle * about;
            let found = left_jacobian_transposed(y, g);
            for axis in DVec3::AXES {
                let at = |h: f64| DQuat::from_scaled_axis(y + h * axis);
                // exp(δ) with which exp(y + h) exceeds exp(y − h).
                let further = rotation_vector(at(1e-5) * at(-1e-5).inverse());
                let difference = further.dot(g) / 2e-5;
                assert!((found.dot(axis) - difference).abs() < 1e-9, "{angle} {axis} {difference}");
            }
        }
    }

    #[test]
    fn gradients_are_by_the_coordinates() {
        let camera = Camera::look_at(DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO, DVec3::Y, 0.7);
        let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
        let mut d = Description::new(camera, film);
        let white = d.add_material(Material::diffuse("white", DVec3::splat(0.7)));
        d.add_shape("block", crate::geometry::Mesh::cube(), white);
        let mut scene = Scene::new(d).unwrap();
        let names = ["block.translation", "block.rotation", "camera.rotation", "white.reflectance"];
        let parameters = Parameters::new(&scene, &names).unwrap();
        let mut origin = parameters.values(&scene);
        parameters.retract(&mut origin, &[0.1, 0.2, 0.3, 0.5, -0.4, 0.8, 0.3, 0.2, -0.6, -0.2, 0.1, 0.0]);
        let chart = Chart::new(&parameters, &origin);
        let y = [0.3, -0.2, 0.1, -0.9, 0.3, 0.5, 0.1, 0.4, -0.7, 0.05, -0.1, 0.1];
        // A function of the scene: Σ cᵢ·pᵢ + e·forward.
        let weights = |i: usize| DVec3::new((i as f64).sin(), (2.0 * i as f64).cos(), 0.3);
        let e = DVec3::new(0.4, -0.3, 0.9);
        let mut value = |y: &[f64]| {
            parameters.apply(&chart.point(y), &mut scene).unwrap();
            let sum: f64 = (0..).zip(&scene.positions).map(|(i, p)| weights(i).dot(*p)).sum();
            sum + e.dot(scene.description().camera.forward)
        };
        let differences: Vec<f64> = (0..y.len())
            .map(|k| {
                let mut at = |h: f64| {
                    let mut there = y;
                    there[k] += h;
                    value(&there)
                };
                (at(1e-5) - at(-1e-5)) / 2e-5
            })
            .collect();
        value(&y);
        let mut covector = crate::gradient::Tangent::still(&scene);
        covector.positions.iter_mut().enumerate().for_each(|(i, p)| *p = weights(i));
        covector.camera.rotation = scene.description().camera.forward.cross(e);
        let gradient = chart.gradient(&y, &parameters.gradient(&scene, &chart.point(&y), &covector));
        for (found, difference) in gradient.iter().zip(&differences) {
            assert!((found - difference).abs() < 1e-8, "{gradient:?} {differences:?}");
        }
        let bounds = chart.bounds();
        assert!((bounds[9][1] - (1.0 - origin[9])).abs() < 1e-15 && bounds[0][1] == f64::INFINITY);
    }
}
