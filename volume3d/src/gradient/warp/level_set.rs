//! Points of moving level sets, over dual numbers.

use flatland::calculus::{Dual, Vec3};
use flatland::sdf::{Jet, SecondOrder};
use glam::DVec3;

/// x and ∇φ on a moving level set, with φ̇ and ∇φ̇ of every lane: ẋ − ω (φ̇ + ∇φ·ẋ)/(∇φ·ω), and ∇φ changes
/// with x and with the parameters.
pub(crate) fn level_set<const N: usize>(
    there: &SecondOrder<DVec3>,
    x: Vec3<Dual<N>>,
    direction: DVec3,
    own: impl Fn(usize) -> Jet<DVec3>,
) -> (Vec3<Dual<N>>, Vec3<Dual<N>>) {
    let along = there.jet.gradient.dot(direction);
    let (mut position, mut gradient) = (x, Vec3::constant(there.jet.gradient));
    for l in 0..N {
        let (own, rate) = (own(l), lane(x, l));
        let moved = rate - direction * ((own.value + there.jet.gradient.dot(rate)) / along);
        let turned = own.gradient + there.hessian * moved;
        for (number, rate) in [(&mut position, moved), (&mut gradient, turned)] {
            number.x.tangent[l] = rate.x;
            number.y.tangent[l] = rate.y;
            number.z.tangent[l] = rate.z;
        }
    }
    (position, gradient)
}

/// The derivative of a vector along one lane.
pub(crate) fn lane<const N: usize>(v: Vec3<Dual<N>>, lane: usize) -> DVec3 {
    DVec3::new(v.x.tangent[lane], v.y.tangent[lane], v.z.tangent[lane])
}
