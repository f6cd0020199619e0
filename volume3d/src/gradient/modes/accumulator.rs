//! Accumulators of reverse mode: sums of the derivatives by each parameter.

use std::sync::{Mutex, PoisonError};

use flatland::sdf::{Jet, Sdf as _, SecondOrder};
use glam::DVec3;

use crate::gradient::parameters::rows::Rows;
use crate::gradient::results::contribution::{Contribution, Source};
use crate::gradient::results::result::Gradient;
use crate::gradient::run::non_finite::NonFinite;
use crate::gradient::run::parts::in_order;
use crate::gradient::{ActiveParameters, ImplicitTangent, Progress, Stopped};
use crate::scene::{ImplicitShape, Scene, TraceCounts};

/// Sums over all parts of the work.
#[derive(Debug)]
pub(in crate::gradient) struct Sums {
    shapes: Vec<ImplicitShape>,
    rows: Rows,
    table: Vec<DVec3>,
    implicits: Vec<ImplicitTangent>,
    non_finite: Vec<NonFinite>,
    largest: Option<Contribution>,
}

/// Sums over one part (a row of the film or a chunk of samples), to which samples are added in sequence.
///
/// The table has a row for every parameter, but a part touches few of them: its result is handed over sparse
/// and the table is reused. There are no more tables than threads.
#[derive(Debug)]
pub(in crate::gradient) struct Accumulator {
    table: Vec<DVec3>,
    /// Nonzero rows of the table.
    touched: Vec<u32>,
    /// Number of leading rows that hold positions.
    positions: u32,
    /// Contributions to the parameters of implicit surfaces: index, point x, and covector of (φ̇, ∇φ̇) at x.
    taps: Vec<(u32, DVec3, Jet<DVec3>)>,
    /// Contributions to the placement of each implicit surface.
    placements: Vec<ImplicitTangent>,
    /// Contributions of the current sample to positions.
    sample: Vec<(u32, DVec3)>,
    non_finite: Vec<NonFinite>,
    largest: Option<Contribution>,
}

/// Sums of one part.
struct Part {
    rows: Vec<(u32, DVec3)>,
    taps: Vec<(u32, DVec3, Jet<DVec3>)>,
    placements: Vec<ImplicitTangent>,
    non_finite: Vec<NonFinite>,
    largest: Option<Contribution>,
}

impl Sums {
    /// Empty sums.
    pub(in crate::gradient) fn new(scene: &Scene) -> Self {
        let rows = Rows::new(scene);
        let table = vec![DVec3::ZERO; rows.count()];
        let shapes = scene.implicits().to_vec();
        let implicits = shapes.iter().map(ImplicitTangent::no_gradient).collect();
        Self { shapes, rows, table, implicits, non_finite: vec![], largest: None }
    }

    /// Adds `parts` parts; the result has the same bits at any number of threads.
    pub(in crate::gradient) fn gather(
        &mut self,
        parts: usize,
        progress: &Progress,
        part: impl Fn(usize, &mut Accumulator) + Sync,
    ) -> Result<(), Stopped> {
        let Self { shapes, rows, table, implicits, non_finite, largest } = self;
        let free: Mutex<Vec<Accumulator>> = Mutex::new(vec![]);
        let free = || free.lock().unwrap_or_else(PoisonError::into_inner);
        let compute = |number| {
            let clean = free().pop();
            let mut sums = clean.unwrap_or_else(|| Accumulator::new(rows, shapes.len()));
            part(number, &mut sums);
            let part = sums.take();
            free().push(sums);
            part
        };
        in_order(parts, progress, compute, |_, part| {
            part.rows.into_iter().for_each(|(row, sum)| table[row as usize] += sum);
            for (implicit, (shape, sum)) in shapes.iter().zip(&mut *implicits).enumerate() {
                let own = part.taps.iter().filter(|tap| tap.0 == implicit as u32);
                let taps: Vec<(DVec3, Jet<DVec3>)> = own.map(|&(_, x, covector)| (x, covector)).collect();
                shape.add_parameter_gradients(&taps, &mut sum.parameters);
            }
            implicits.iter_mut().zip(&part.placements).for_each(|(sum, part)| sum.add(part));
            non_finite.extend(part.non_finite);
            Contribution::merge(largest, part.largest);
        })
    }

    /// The gradient, after covectors of computed normals are propagated to positions.
    pub(in crate::gradient) fn finish(self, scene: &Scene, active: &ActiveParameters) -> Gradient {
        let mut by_parameter = self.rows.tangent(&self.table);
        let implicits = self.implicits.into_iter().zip(&self.shapes);
        by_parameter.implicits = implicits.map(|(gradient, shape)| gradient.pulled_back(shape)).collect();
        by_parameter.pull_normals(scene, active);
        Gradient {
            by_parameter,
            non_finite: self.non_finite,
            traces: TraceCounts::default(),
            left_out: vec![],
            largest: self.largest,
        }
    }
}

impl Accumulator {
    fn new(rows: &Rows, implicits: usize) -> Self {
        let table = vec![DVec3::ZERO; rows.count()];
        Self {
            table,
            touched: vec![],
            positions: rows.positions(),
            taps: vec![],
            placements: vec![ImplicitTangent::default(); implicits],
            sample: vec![],
            non_finite: vec![],
            largest: None,
        }
    }

    /// Adds a covector of (φ̇, ∇φ̇) at x to the gradient of an implicit surface.
    pub(in crate::gradient) fn add_implicit(
        &mut self,
        implicit: u32,
        shape: &ImplicitShape,
        x: DVec3,
        there: &SecondOrder<DVec3>,
        covector: Jet<DVec3>,
    ) {
        if covector != Jet::ZERO {
            self.placements[implicit as usize].scatter_motion(shape, x, there, covector);
            self.taps.push((implicit, x, covector));
        }
    }

    /// Adds a covector to a row of the table.
    pub(in crate::gradient) fn add(&mut self, row: u32, covector: DVec3) {
        if covector == DVec3::ZERO {
            return;
        }
        if row < self.positions {
            self.sample.push((row, covector));
        }
        let sum = &mut self.table[row as usize];
        if *sum == DVec3::ZERO {
            self.touched.push(row);
        }
        *sum += covector;
    }

    /// Records a non-finite sample, which is excluded.
    pub(in crate::gradient) fn leave_out(&mut self, at: NonFinite) {
        self.non_finite.push(at);
    }

    /// Ends a sample and keeps it if it contributes more than all before it. A contribution is Σ |·| over
    /// positions of the net covector, in which terms of opposite sign cancel.
    pub(in crate::gradient) fn end_sample(&mut self, at: NonFinite, source: Source) {
        if self.sample.is_empty() {
            return;
        }
        let largest = self.largest.map_or(0.0, |largest| largest.amount);
        let bound: f64 = self.sample.iter().map(|(_, covector)| covector.abs().element_sum()).sum();
        // The exact amount is needed only if the bound exceeds the largest so far.
        let amount = if bound > largest { net(&mut self.sample) } else { 0.0 };
        let sample = Contribution { among: 1, ..Contribution::new(at, source, amount) };
        Contribution::merge(&mut self.largest, Some(sample));
        self.sample.clear();
    }

    /// Hands over the sums and empties the accumulator.
    fn take(&mut self) -> Part {
        let Self { table, touched, .. } = self;
        let sums = touched.drain(..).map(|row| (row, std::mem::take(&mut table[row as usize])));
        // A row whose sum passed through zero is listed twice.
        let rows = sums.filter(|(_, sum)| *sum != DVec3::ZERO).collect();
        self.sample.clear();
        let placements = self.placements.iter_mut().map(std::mem::take).collect();
        let taps = std::mem::take(&mut self.taps);
        Part {
            rows,
            taps,
            placements,
            non_finite: std::mem::take(&mut self.non_finite),
            largest: self.largest.take(),
        }
    }
}

/// Σ over positions of |Σ covectors|.
fn net(touched: &mut [(u32, DVec3)]) -> f64 {
    touched.sort_by_key(|(index, _)| *index);
    let by_position = touched.chunk_by(|a, b| a.0 == b.0);
    by_position.map(|same| same.iter().map(|(_, c)| *c).sum::<DVec3>().abs().element_sum()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::tests::square;
    use crate::scene::Filter;

    fn at(sample: usize) -> NonFinite {
        NonFinite { column: 1, row: 2, sample }
    }

    fn gathered(parts: usize, part: impl Fn(usize, &mut Accumulator) + Sync) -> Gradient {
        let scene = square(Filter::Box);
        let mut sums = Sums::new(&scene);
        sums.gather(parts, &Progress::none(), part).expect("nothing stops it");
        sums.finish(&scene, &ActiveParameters::everything(&scene))
    }

    #[test]
    fn the_largest_sample_is_kept_and_its_parts_cancel() {
        let gradient = gathered(1, |_, sums| {
            for (index, covector) in [(0, DVec3::X), (1, DVec3::Y), (0, -DVec3::X)] {
                sums.add(index, covector);
            }
            sums.end_sample(at(0), Source::Path);
            sums.add(2, DVec3::new(2.0, -0.5, 0.0));
            sums.end_sample(at(1), Source::Jump);
            sums.add(2, DVec3::new(-2.0, 0.0, 0.0));
            sums.end_sample(at(2), Source::Path);
            // A sample that adds nothing does not count.
            sums.end_sample(at(3), Source::Path);
        });
        let largest = gradient.largest.expect("samples");
        let expected = Contribution { among: 3, ..Contribution::new(at(1), Source::Jump, 2.5) };
        assert_eq!(largest, expected);
        // The gradient is (0, 1 ŷ, −½ ŷ): the largest sample is more than all together.
        assert!((gradient.largest_share() - 2.5 / 1.5).abs() < 1e-12);
        assert!(gradient.outlier().is_none(), "three samples have much each");
    }

    /// Many parts reuse few tables, each of which must be empty again after every part.
    #[test]
    fn parts_add_up_and_leave_nothing_behind() {
        let parts = 200;
        let gradient = gathered(parts, |part, sums| {
            sums.add(0, DVec3::X);
            sums.add(1, DVec3::Y);
            sums.add(1, -DVec3::Y);
            sums.add(1, DVec3::Z * part as f64);
            if part % 2 == 1 {
                sums.leave_out(at(part));
            }
        });
        let (n, positions) = (parts as f64, &gradient.by_parameter.positions);
        assert_eq!(positions[..3], [n * DVec3::X, 0.5 * n * (n - 1.0) * DVec3::Z, DVec3::ZERO]);
        assert!(gradient.non_finite.iter().map(|bad| bad.sample).eq((1..parts).step_by(2)));
    }
}
