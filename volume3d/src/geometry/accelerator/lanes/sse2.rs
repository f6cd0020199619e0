//! Eight lanes in two 128-bit registers: what every x86-64 machine has.

use std::arch::x86_64::__m128;

use pulp::x86::V1;

use super::{Lanes, Row};

/// The low four lanes and the high four.
type Pair = [__m128; 2];

impl Lanes for V1 {
    type Float = Pair;

    #[inline(always)]
    fn splat(self, value: f32) -> Pair {
        [self.sse._mm_set1_ps(value); 2]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Pair {
        let [a, b, c, d, e, f, g, h] = *row;
        [self.sse._mm_setr_ps(a, b, c, d), self.sse._mm_setr_ps(e, f, g, h)]
    }

    #[inline(always)]
    fn store(self, a: Pair) -> Row {
        pulp::cast(a)
    }

    #[inline(always)]
    fn add(self, a: Pair, b: Pair) -> Pair {
        [self.sse._mm_add_ps(a[0], b[0]), self.sse._mm_add_ps(a[1], b[1])]
    }

    #[inline(always)]
    fn sub(self, a: Pair, b: Pair) -> Pair {
        [self.sse._mm_sub_ps(a[0], b[0]), self.sse._mm_sub_ps(a[1], b[1])]
    }

    #[inline(always)]
    fn mul(self, a: Pair, b: Pair) -> Pair {
        [self.sse._mm_mul_ps(a[0], b[0]), self.sse._mm_mul_ps(a[1], b[1])]
    }

    #[inline(always)]
    fn mul_add(self, a: Pair, b: Pair, c: Pair) -> Pair {
        self.add(self.mul(a, b), c)
    }

    #[inline(always)]
    fn mul_sub_from(self, a: Pair, b: Pair, c: Pair) -> Pair {
        self.sub(c, self.mul(a, b))
    }

    #[inline(always)]
    fn min(self, a: Pair, b: Pair) -> Pair {
        [self.sse._mm_min_ps(a[0], b[0]), self.sse._mm_min_ps(a[1], b[1])]
    }

    #[inline(always)]
    fn max(self, a: Pair, b: Pair) -> Pair {
        [self.sse._mm_max_ps(a[0], b[0]), self.sse._mm_max_ps(a[1], b[1])]
    }

    #[inline(always)]
    fn abs(self, a: Pair) -> Pair {
        let sign = self.sse._mm_set1_ps(-0.0);
        [self.sse._mm_andnot_ps(sign, a[0]), self.sse._mm_andnot_ps(sign, a[1])]
    }

    #[inline(always)]
    fn less_equal(self, a: Pair, b: Pair) -> u32 {
        let low = self.sse._mm_movemask_ps(self.sse._mm_cmple_ps(a[0], b[0])) as u32;
        let high = self.sse._mm_movemask_ps(self.sse._mm_cmple_ps(a[1], b[1])) as u32;
        low | high << 4
    }
}
