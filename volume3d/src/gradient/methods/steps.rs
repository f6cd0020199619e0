//! Default steps of finite differences for a scene and a change.

use glam::DVec3;

use crate::gradient::{CameraTangent, FiniteDifference, ImplicitTangent, Tangent};
use crate::scene::Scene;

/// How far the fastest parameter moves, as fractions of the scene's size, of a radian, or of a unit of
/// radiance, intensity, reflectance or roughness. Below the smallest, noise dominates in most scenes; above
/// the largest, the curvature does.
const FRACTIONS: [f64; 4] = [1e-2, 3e-3, 1e-3, 3e-4];

impl FiniteDifference {
    /// Steps from large to small: the fastest parameter moves by 10⁻², 3·10⁻³, 10⁻³ and 3·10⁻⁴ of
    /// the scene's size, of a radian, or of a unit of radiance, intensity, reflectance or roughness.
    #[must_use]
    pub fn steps(scene: &Scene, change: &Tangent) -> Vec<f64> {
        let fastest = |rates: &[DVec3]| rates.iter().map(|r| r.length()).fold(0.0, f64::max);
        let size = size(scene);
        let CameraTangent { translation, rotation, field_of_view } = change.camera;
        let d = scene.description();
        let of_lights = |is_point: bool| {
            let rates = d.lights.iter().zip(&change.pose).filter(|(l, _)| l.position().is_some() == is_point);
            fastest(&rates.map(|(_, rate)| *rate).collect::<Vec<_>>())
        };
        let texels = change.texels.iter().map(|rates| fastest(rates)).fold(0.0, f64::max);
        let implicits = |rate: fn(&ImplicitTangent) -> DVec3| {
            change.implicits.iter().map(|rates| rate(rates).length()).fold(0.0, f64::max)
        };
        let rates = [
            fastest(&change.positions) / size,
            implicits(|rates| rates.translation) / size,
            implicits(|rates| rates.rotation),
            translation.length() / size,
            rotation.length(),
            field_of_view.abs(),
            fastest(&change.reflectance),
            fastest(&change.radiance),
            fastest(&change.intensity),
            texels,
            of_lights(true) / size,
            of_lights(false),
            fastest(&change.light_rotation),
            change.environment_rotation.length(),
            change.environment.length(),
            change.roughness.iter().fold(0.0, |a: f64, b| a.max(b.abs())),
        ];
        let rate = rates.into_iter().fold(0.0, f64::max);
        let scale = if rate > 0.0 { 1.0 / rate } else { 1.0 };
        FRACTIONS.map(|f| f * scale).to_vec()
    }

    /// [`steps`](Self::steps), preceded by a step three times as large, which bounds the error of the next
    /// one. That step is left out if it leads out of a parameter's range and the others do not.
    #[must_use]
    pub fn steps_after_a_larger(scene: &Scene, change: &Tangent) -> Vec<f64> {
        let mut steps = Self::steps(scene, change);
        let larger = 3.0 * steps[0];
        // At a bound of the range all steps are one-sided.
        let is_within = |step| change.displaced(scene, step).is_ok();
        if [1.0, -1.0].iter().all(|sign| is_within(sign * larger) || !is_within(sign * steps[0])) {
            steps.insert(0, larger);
        }
        steps
    }
}

/// The diagonal of the bounding box of all positions; 1 if there are none.
fn size(scene: &Scene) -> f64 {
    let positions = || scene.description().shapes.iter().flat_map(|s| s.mesh.positions());
    let low = positions().fold(DVec3::INFINITY, |a, &b| a.min(b));
    let high = positions().fold(DVec3::NEG_INFINITY, |a, &b| a.max(b));
    let diagonal = (high - low).length();
    if diagonal.is_finite() && diagonal > 0.0 { diagonal } else { 1.0 }
}
