//! Minima of a network along rays, batched over all rays.

use flatland::sdf::Jet;
use glam::DVec3;

use super::along_ray::{Chord, Least, NotFinite};
use crate::scene::ImplicitShape;
use crate::sdf::Baked;

/// Batch size: rays whose points are in memory at once.
const TOGETHER: usize = 1024;

/// Refinement steps. In single precision a minimum, where φ is flat, is known to about the root of the last
/// digit.
const REFINEMENTS: usize = 12;

/// For each chord the least φ, or `None` if a value of at most the chord's threshold is found.
pub(super) fn leasts(
    shape: &ImplicitShape,
    baked: &Baked,
    chords: &[(Chord, f64)],
    samples: usize,
) -> Vec<Result<Option<Least>, NotFinite>> {
    let mut leasts = Vec::with_capacity(chords.len());
    for chords in chords.chunks(TOGETHER) {
        let brackets = brackets(shape, baked, chords, samples);
        let refined = refined(shape, baked, brackets);
        for (least, (_, enough)) in refined.into_iter().zip(chords) {
            let Least { point, jet } = least;
            let is_finite = jet.value.is_finite() && jet.gradient.is_finite();
            let bad = NotFinite { point, value: jet.value };
            leasts.push(if is_finite { Ok((jet.value > *enough).then_some(least)) } else { Err(bad) });
        }
    }
    leasts
}

/// The points next to the best of each chord.
fn brackets(
    shape: &ImplicitShape,
    baked: &Baked,
    chords: &[(Chord, f64)],
    samples: usize,
) -> Vec<[DVec3; 2]> {
    let points: Vec<Vec<DVec3>> = chords.iter().map(|(chord, _)| chord.divided(samples).collect()).collect();
    let local: Vec<DVec3> = points.iter().flatten().map(|&x| shape.local(x)).collect();
    let mut values = &baked.network_values(&local)[..];
    let bracket = |points: Vec<DVec3>| {
        let (own, rest) = values.split_at(points.len());
        values = rest;
        // NaN counts as the least value, so that it is reported.
        let best = (0..own.len())
            .min_by(|&i, &j| own[j].is_nan().cmp(&own[i].is_nan()).then(own[i].total_cmp(&own[j])));
        let best = best.unwrap_or(0);
        [points[best.saturating_sub(1)], points[(best + 1).min(points.len() - 1)]]
    };
    points.into_iter().map(bracket).collect()
}

/// A point on a ray, and the derivative of φ towards the other end of its bracket.
#[derive(Clone, Copy)]
struct Place {
    point: DVec3,
    jet: Jet<DVec3>,
    slope: f64,
}

/// The sign change of ∇φ·ω between two points of each ray, or the lower end where there is none.
fn refined(shape: &ImplicitShape, baked: &Baked, brackets: Vec<[DVec3; 2]>) -> Vec<Least> {
    let look = |points: Vec<DVec3>| -> Vec<Place> {
        let local: Vec<DVec3> = points.iter().map(|&x| shape.local(x)).collect();
        let jets = baked.network_jets(&local).into_iter().map(|jet| shape.placed(jet));
        let place = |((point, jet), [first, last]): ((DVec3, Jet<DVec3>), &[DVec3; 2])| Place {
            point,
            jet,
            slope: jet.gradient.dot(*last - *first),
        };
        points.into_iter().zip(jets).zip(&brackets).map(place).collect()
    };
    let [mut low, mut high] = [0, 1].map(|side| look(brackets.iter().map(|bracket| bracket[side]).collect()));
    for step in 0..REFINEMENTS {
        let between = |(low, high): (&Place, &Place)| {
            let secant = low.slope / (low.slope - high.slope);
            let is_bracket = step % 2 == 0 && low.slope < 0.0 && high.slope > 0.0;
            low.point.lerp(high.point, if is_bracket { secant } else { 0.5 })
        };
        for (i, there) in look(low.iter().zip(&high).map(between).collect()).into_iter().enumerate() {
            if there.slope < 0.0 { low[i] = there } else { high[i] = there }
        }
    }
    let lower = |(low, high): (Place, Place)| if high.jet.value < low.jet.value { high } else { low };
    let ends = low.into_iter().zip(high).map(lower);
    ends.map(|Place { point, jet, .. }| Least { point, jet }).collect()
}
