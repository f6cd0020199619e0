//! Near misses: points where a ray passes a surface without hitting it.

use super::distance::Jet;
use super::space::Space;
use super::tracer::{Trace, View};

/// Bisections of a local minimum: the angle between ∇φ and the normal plane of the ray is then 0 to 2⁻⁵⁰.
const BISECTIONS: usize = 50;

/// Local minima of φ along a traced ray with 0 < φ < ε, where ∇φ·ω = 0. Steps are no longer than φ, so that
/// within the band no minimum is missed between two points.
#[must_use]
pub fn near_misses<V: Space>(view: &View<'_, V>, trace: &Trace<V>, width: f64) -> Vec<V> {
    let omega = trace.direction;
    let slope = |jet: Jet<V>| jet.gradient.dot(omega);
    let brackets = trace.points.windows(2).filter(|p| slope(p[0].jet) < 0.0 && slope(p[1].jet) >= 0.0);
    let minima = brackets.map(|p| {
        let (mut low, mut high) = (p[0].t, p[1].t);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if slope(view.sdf.jet(view.eye + omega * middle)) < 0.0 { low = middle } else { high = middle }
        }
        view.eye + omega * (0.5 * (low + high))
    });
    minima.filter(|x| (0.0..width).contains(&view.sdf.jet(*x).value)).collect()
}
