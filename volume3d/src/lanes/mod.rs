//! SIMD lanes: eight single-precision numbers, or four in double precision, in the widest registers of the
//! machine.
//!
//! Filters of the mesh traversal, and sums over grid nodes, are written once over [`Lanes`]. The filters are
//! conservative in every implementation; a fused or unfused [`Lanes::mul_add`] changes which triangles are
//! tested in double precision, never the result.
//!
//! Code is generated for an instruction set only where it is inlined into [`Instructions::run`]. Everything
//! on that path is therefore `#[inline(always)]`, without closures, which cannot be (and `array::map` with
//! them).

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;
#[cfg(target_arch = "x86_64")]
mod sse2;

#[cfg(target_arch = "x86_64")]
use pulp::x86::{V1, V3};

/// Number of lanes, of children of a node and of triangles in a leaf.
pub(crate) const WIDTH: usize = 8;

/// One number per lane, in memory.
pub(crate) type Row = [f32; WIDTH];

/// One integer below 2¹⁶ per lane.
pub(crate) type Steps = [u16; WIDTH];

/// Half a row, in double precision.
pub(crate) type Half = [f64; WIDTH / 2];

/// Arithmetic on eight lanes. Comparisons return one bit per lane, lane 0 lowest.
pub(crate) trait Lanes: Copy {
    /// Eight single-precision numbers in registers.
    type Float: Copy;
    /// Four double-precision numbers. Operations are never fused, so that results equal those of scalar code.
    type Double: Copy;

    fn splat(self, value: f32) -> Self::Float;
    fn load(self, row: &Row) -> Self::Float;
    fn load_steps(self, row: &Steps) -> Self::Float;
    fn store(self, a: Self::Float) -> Row;
    fn add(self, a: Self::Float, b: Self::Float) -> Self::Float;
    fn sub(self, a: Self::Float, b: Self::Float) -> Self::Float;
    fn mul(self, a: Self::Float, b: Self::Float) -> Self::Float;
    /// a b + c, rounded once or twice.
    fn mul_add(self, a: Self::Float, b: Self::Float, c: Self::Float) -> Self::Float;
    /// a b − c, rounded once or twice.
    fn mul_sub(self, a: Self::Float, b: Self::Float, c: Self::Float) -> Self::Float;
    /// c − a b, rounded once or twice.
    fn mul_sub_from(self, a: Self::Float, b: Self::Float, c: Self::Float) -> Self::Float;
    fn min(self, a: Self::Float, b: Self::Float) -> Self::Float;
    fn max(self, a: Self::Float, b: Self::Float) -> Self::Float;
    fn abs(self, a: Self::Float) -> Self::Float;
    fn sqrt(self, a: Self::Float) -> Self::Float;
    fn less_equal(self, a: Self::Float, b: Self::Float) -> u32;

    /// Transposes bits: bit j of byte i becomes bit i of number j.
    fn by_bit(self, bytes: &[u8; 4 * WIDTH]) -> [u32; WIDTH];
    fn splat_double(self, value: f64) -> Self::Double;
    fn load_double(self, half: &Half) -> Self::Double;
    fn store_double(self, a: Self::Double) -> Half;
    fn add_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    fn sub_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    fn mul_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    fn div_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    /// a where a < b, else b.
    fn min_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    /// a where a > b, else b.
    fn max_double(self, a: Self::Double, b: Self::Double) -> Self::Double;
    fn abs_double(self, a: Self::Double) -> Self::Double;
    fn less_double(self, a: Self::Double, b: Self::Double) -> u32;
    fn prefetch(self, address: *const i8);
}

/// A computation compiled for each implementation.
pub(crate) trait Task {
    type Output;
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// The instruction set detected.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    #[cfg(target_arch = "x86_64")]
    Sse2(V1),
    Portable,
}

impl Default for Instructions {
    fn default() -> Self {
        Self::detect()
    }
}

impl Instructions {
    /// The best one of this machine.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(v3) = V3::try_new() {
                return Self::Avx2(v3);
            }
            if let Some(v1) = V1::try_new() {
                return Self::Sse2(v1);
            }
        }
        Self::Portable
    }

    #[inline(always)]
    pub(crate) fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(v3) => v3.vectorize(avx2::Vectorized(v3, task)),
            #[cfg(target_arch = "x86_64")]
            Self::Sse2(v1) => task.run(v1),
            Self::Portable => task.run(portable::Portable),
        }
    }
}

/// Removes the lowest lane from a nonempty mask, and returns it.
#[inline(always)]
pub(crate) fn next(mask: &mut u32) -> usize {
    let lane = mask.trailing_zeros() as usize;
    *mask &= *mask - 1;
    lane
}

#[cfg(test)]
mod tests {
    use super::*;

    struct ByBit<'a>(&'a [u8; 4 * WIDTH]);

    impl Task for ByBit<'_> {
        type Output = [u32; WIDTH];

        fn run<L: Lanes>(self, lanes: L) -> [u32; WIDTH] {
            lanes.by_bit(self.0)
        }
    }

    #[test]
    fn every_bit_finds_its_place() {
        let mut all = vec![Instructions::Portable, Instructions::detect()];
        #[cfg(target_arch = "x86_64")]
        all.extend(V1::try_new().map(Instructions::Sse2));
        for (i, j) in (0..4 * WIDTH).flat_map(|i| (0..WIDTH).map(move |j| (i, j))) {
            let (mut bytes, mut expected) = ([0; 4 * WIDTH], [0; WIDTH]);
            (bytes[i], expected[j]) = (1 << j, 1 << i);
            for instructions in &all {
                assert_eq!(instructions.run(ByBit(&bytes)), expected, "{instructions:?}");
            }
        }
    }
}
