//! Evaluation of a grid at a point, compiled for the widest instructions of the machine.

use flatland::sdf::{Jet, SecondOrder};
use glam::DVec3;

use super::Interpolation;
use super::kernel::{Stencil, Weights};
use crate::lanes::{self, Lanes, Task};

/// The instruction set detected.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Instructions(lanes::Instructions);

/// A point of evaluation, with the values that are multiplied by the weights: one per node.
pub(super) struct Visit<'a> {
    pub(super) interpolation: Interpolation,
    /// The point, relative to the first node, in spacings.
    pub(super) local: DVec3,
    pub(super) per_length: DVec3,
    pub(super) size: [usize; 3],
    pub(super) values: &'a [f64],
}

/// Results have the same bits on all machines.
impl PartialEq for Instructions {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Instructions {
    pub(super) fn value(self, visit: Visit<'_>) -> f64 {
        self.0.run(Value(visit))
    }

    pub(super) fn jet(self, visit: Visit<'_>) -> Jet<DVec3> {
        self.0.run(First(visit))
    }

    pub(super) fn second_order(self, visit: Visit<'_>) -> SecondOrder<DVec3> {
        self.0.run(Second(visit))
    }

    /// Transpose of [`jet`](Self::jet), added to one number per node; the visit's own values are not used.
    pub(super) fn add_transpose(self, visit: Visit<'_>, covector: Jet<DVec3>, gradient: &mut [f64]) {
        self.0.run(Transpose { visit, covector, gradient });
    }
}

impl Visit<'_> {
    #[inline(always)]
    fn stencil<L: Lanes, const N: usize>(&self, lanes: L, weights: &Weights) -> Stencil<L, N> {
        Stencil::new(lanes, self.local, self.per_length, self.size, weights)
    }
}

struct Value<'a>(Visit<'a>);

impl Task for Value<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        match self.0.interpolation {
            Interpolation::Trilinear => self.0.stencil::<L, 2>(lanes, &Weights::LINEAR).value(self.0.values),
            Interpolation::Cubic => self.0.stencil::<L, 4>(lanes, &Weights::CUBIC).value(self.0.values),
        }
    }
}

struct First<'a>(Visit<'a>);

impl Task for First<'_> {
    type Output = Jet<DVec3>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Jet<DVec3> {
        match self.0.interpolation {
            Interpolation::Trilinear => self.0.stencil::<L, 2>(lanes, &Weights::LINEAR).jet(self.0.values),
            Interpolation::Cubic => self.0.stencil::<L, 4>(lanes, &Weights::CUBIC).jet(self.0.values),
        }
    }
}

struct Second<'a>(Visit<'a>);

impl Task for Second<'_> {
    type Output = SecondOrder<DVec3>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> SecondOrder<DVec3> {
        match self.0.interpolation {
            Interpolation::Trilinear => {
                self.0.stencil::<L, 2>(lanes, &Weights::LINEAR).second_order(self.0.values)
            }
            Interpolation::Cubic => {
                self.0.stencil::<L, 4>(lanes, &Weights::CUBIC).second_order(self.0.values)
            }
        }
    }
}

struct Transpose<'a> {
    visit: Visit<'a>,
    covector: Jet<DVec3>,
    gradient: &'a mut [f64],
}

impl Task for Transpose<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { visit, covector, gradient } = self;
        match visit.interpolation {
            Interpolation::Trilinear => {
                visit.stencil::<L, 2>(lanes, &Weights::LINEAR).add_transpose(covector, gradient);
            }
            Interpolation::Cubic => {
                visit.stencil::<L, 4>(lanes, &Weights::CUBIC).add_transpose(covector, gradient);
            }
        }
    }
}
