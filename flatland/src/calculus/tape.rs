//! Tape: a record of one path's arithmetic, swept backwards for the derivative by every parameter at once.

use std::cell::RefCell;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::Number;
use super::number::operators;

/// Index of no node: a constant.
const NONE: u32 = u32::MAX;

/// Operands of one operation, and the derivatives of its result by them.
#[derive(Clone, Copy, Debug)]
struct Node {
    operands: [u32; 2],
    partials: [f64; 2],
}

/// A run of inputs declared together, whose adjoints a sweep reports.
#[derive(Clone, Copy, Debug)]
struct Input<I> {
    first: u32,
    count: u32,
    id: I,
}

#[derive(Debug)]
struct Record<I> {
    nodes: Vec<Node>,
    inputs: Vec<Input<I>>,
}

/// The operations of one sample, in order. Inputs are identified by an `I`.
///
/// An input may be the *output* of an operation outside the tape, such as a warp: the sweep then reports its
/// adjoints when they are complete, and the callback may add to the adjoints of earlier nodes.
#[derive(Debug)]
pub struct Tape<I> {
    record: RefCell<Record<I>>,
}

/// A number that records its operations on a tape.
#[derive(Debug)]
pub struct Variable<'t, I> {
    tape: Option<&'t Tape<I>>,
    node: u32,
    value: f64,
}

impl<I> Clone for Variable<'_, I> {
    #[inline]
    fn clone(&self) -> Self {
        *self
    }
}

impl<I> Copy for Variable<'_, I> {}

/// Adjoint of a sweep: a number, or several that are kept separate, as the terms of a derivative.
pub trait Adjoint: Copy + Default + PartialEq + AddAssign + Mul<f64, Output = Self> {}

impl<A: Copy + Default + PartialEq + AddAssign + Mul<f64, Output = A>> Adjoint for A {}

/// The adjoints of a sweep in progress.
#[derive(Debug)]
pub struct Adjoints<'a, A = f64> {
    values: &'a mut Vec<A>,
}

impl<A: Adjoint> Adjoints<'_, A> {
    /// Adds to the adjoint of an earlier variable.
    #[inline]
    pub fn add<I>(&mut self, variable: Variable<'_, I>, amount: A) {
        if variable.node != NONE {
            self.values[variable.node as usize] += amount;
        }
    }
}

impl<I> Default for Tape<I> {
    fn default() -> Self {
        Self { record: RefCell::new(Record { nodes: vec![], inputs: vec![] }) }
    }
}

impl<I: Copy> Tape<I> {
    /// An empty tape.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Clears the tape, keeping its memory.
    pub fn clear(&mut self) {
        let record = self.record.get_mut();
        record.nodes.clear();
        record.inputs.clear();
    }

    /// Declares inputs that belong together, at most eight. Numbers of different tapes must not be combined.
    #[inline]
    pub fn inputs<const K: usize>(&self, id: I, values: [f64; K]) -> [Variable<'_, I>; K] {
        const { assert!(K <= MAX_INPUTS, "a longer run of inputs than a sweep reports") };
        let record = &mut *self.record.borrow_mut();
        let first = record.nodes.len() as u32;
        record.inputs.push(Input { first, count: K as u32, id });
        let leaf = Node { operands: [NONE; 2], partials: [0.0; 2] };
        record.nodes.extend([leaf; K]);
        std::array::from_fn(|i| Variable { tape: Some(self), node: first + i as u32, value: values[i] })
    }

    /// Sweeps backwards from `outputs`, each with its initial adjoint, and reports the adjoints of every run
    /// of inputs, last declared first. `values` is working memory.
    pub fn sweep<A: Adjoint>(
        &self,
        outputs: &[(Variable<'_, I>, A)],
        values: &mut Vec<A>,
        mut report: impl FnMut(I, &[A], &mut Adjoints<'_, A>),
    ) {
        let record = &*self.record.borrow();
        values.clear();
        values.resize(record.nodes.len(), A::default());
        for &(output, adjoint) in outputs {
            Adjoints { values }.add(output, adjoint);
        }
        let mut end = record.nodes.len();
        for input in record.inputs.iter().rev() {
            let (first, after) = (input.first as usize, (input.first + input.count) as usize);
            propagate(&record.nodes, values, after..end);
            end = first;
            let mut own = [A::default(); MAX_INPUTS];
            let own = &mut own[..after - first];
            own.copy_from_slice(&values[first..after]);
            if own.iter().any(|&a| a != A::default()) {
                report(input.id, own, &mut Adjoints { values });
            }
        }
        // Nodes before the first input have constant operands only.
    }
}

/// The longest run of inputs.
const MAX_INPUTS: usize = 8;

fn propagate<A: Adjoint>(nodes: &[Node], adjoints: &mut [A], range: std::ops::Range<usize>) {
    for i in range.rev() {
        let adjoint = adjoints[i];
        if adjoint != A::default() {
            let Node { operands, partials } = nodes[i];
            for (operand, partial) in operands.into_iter().zip(partials) {
                if operand != NONE {
                    adjoints[operand as usize] += adjoint * partial;
                }
            }
        }
    }
}

impl<'t, I: Copy> Variable<'t, I> {
    #[inline]
    fn binary(self, other: Self, value: f64, partials: [f64; 2]) -> Self {
        let Some(tape) = self.tape.or(other.tape) else {
            return Self { tape: None, node: NONE, value };
        };
        let nodes = &mut tape.record.borrow_mut().nodes;
        nodes.push(Node { operands: [self.node, other.node], partials });
        Self { tape: Some(tape), node: nodes.len() as u32 - 1, value }
    }
}

impl<'t, I: Copy + Debug> Number for Variable<'t, I> {
    #[inline]
    fn constant(value: f64) -> Self {
        Self { tape: None, node: NONE, value }
    }

    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn chain(self, value: f64, derivative: f64) -> Self {
        self.binary(Self::constant(0.0), value, [derivative, 0.0])
    }

    #[inline]
    fn is_still(self) -> bool {
        self.node == NONE
    }
}

operators!(['t, I: Copy + Debug] Variable<'t, I>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculus::Dual;

    fn expression<T: Number>(x: T, y: T) -> T {
        ((x * y + x.exp()) / (y - x * 0.3).sqrt() - -y).squared().positive() + x.sin() * y.cos() - x.sinh()
    }

    #[test]
    fn the_sweep_is_the_transpose_of_the_tangent() {
        let (x, y) = (0.4, 1.7);
        let dual = expression(Dual::new(x, [1.0, 0.0]), Dual::new(y, [0.0, 1.0]));
        let tape = Tape::new();
        let [a] = tape.inputs("x", [x]);
        let [b, unused] = tape.inputs("y", [y, 3.0]);
        let result = expression(a, b) + Variable::constant(2.0) * unused.chain(0.0, 0.0);
        assert_eq!(result.value.to_bits(), dual.value.to_bits());
        let mut found = vec![];
        tape.sweep(&[(result, 2.0)], &mut vec![], |id, adjoints, _| found.push((id, adjoints[0])));
        assert_eq!(found[0].0, "y");
        assert!((found[0].1 - 2.0 * dual.tangent[1]).abs() < 1e-14);
        assert!((found[1].1 - 2.0 * dual.tangent[0]).abs() < 1e-14);
    }

    #[test]
    fn an_output_of_something_outside_passes_its_adjoint_on() {
        // z = 3 x is computed outside the tape.
        let tape = Tape::new();
        let [x] = tape.inputs(0, [2.0]);
        let [z] = tape.inputs(1, [6.0]);
        let result = z * x;
        let mut derivative = 0.0;
        tape.sweep(&[(result, 1.0)], &mut vec![], |id, adjoints, earlier| match id {
            1 => earlier.add(x, 3.0 * adjoints[0]),
            _ => derivative = adjoints[0],
        });
        assert_eq!(derivative, 12.0);
    }
}
