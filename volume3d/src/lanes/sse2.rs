//! Eight lanes in two 128-bit registers, available on every x86-64 machine.

use std::arch::x86_64::{__m128, __m128d, __m128i, _MM_HINT_T0};

use pulp::x86::V1;

use super::{Half, Lanes, Row, Steps, WIDTH};

/// The low four lanes and the high four.
type Pair = [__m128; 2];
/// Double precision: two lanes and two.
type PairDouble = [__m128d; 2];

impl Lanes for V1 {
    type Float = Pair;
    type Double = PairDouble;

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
    fn load_steps(self, row: &Steps) -> Pair {
        let (words, zero) = (pulp::cast(*row), self.sse2._mm_setzero_si128());
        [
            self.sse2._mm_cvtepi32_ps(self.sse2._mm_unpacklo_epi16(words, zero)),
            self.sse2._mm_cvtepi32_ps(self.sse2._mm_unpackhi_epi16(words, zero)),
        ]
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
    fn mul_sub(self, a: Pair, b: Pair, c: Pair) -> Pair {
        self.sub(self.mul(a, b), c)
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
    fn sqrt(self, a: Pair) -> Pair {
        [self.sse._mm_sqrt_ps(a[0]), self.sse._mm_sqrt_ps(a[1])]
    }

    #[inline(always)]
    fn less_equal(self, a: Pair, b: Pair) -> u32 {
        let low = self.sse._mm_movemask_ps(self.sse._mm_cmple_ps(a[0], b[0])) as u32;
        let high = self.sse._mm_movemask_ps(self.sse._mm_cmple_ps(a[1], b[1])) as u32;
        low | high << 4
    }

    #[inline(always)]
    fn by_bit(self, bytes: &[u8; 4 * WIDTH]) -> [u32; WIDTH] {
        let [mut low, mut high]: [__m128i; 2] = pulp::cast(*bytes);
        let mut numbers = [0; WIDTH];
        // The highest bit of each byte, then the next one.
        for number in numbers.iter_mut().rev() {
            let [a, b] = [self.sse2._mm_movemask_epi8(low), self.sse2._mm_movemask_epi8(high)];
            *number = (a | b << 16) as u32;
            low = self.sse2._mm_add_epi8(low, low);
            high = self.sse2._mm_add_epi8(high, high);
        }
        numbers
    }

    #[inline(always)]
    fn splat_double(self, value: f64) -> PairDouble {
        [self.sse2._mm_set1_pd(value); 2]
    }

    #[inline(always)]
    fn load_double(self, half: &Half) -> PairDouble {
        pulp::cast(*half)
    }

    #[inline(always)]
    fn store_double(self, a: PairDouble) -> Half {
        pulp::cast(a)
    }

    #[inline(always)]
    fn add_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_add_pd(a[0], b[0]), self.sse2._mm_add_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn sub_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_sub_pd(a[0], b[0]), self.sse2._mm_sub_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn mul_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_mul_pd(a[0], b[0]), self.sse2._mm_mul_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn div_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_div_pd(a[0], b[0]), self.sse2._mm_div_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn min_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_min_pd(a[0], b[0]), self.sse2._mm_min_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn max_double(self, a: PairDouble, b: PairDouble) -> PairDouble {
        [self.sse2._mm_max_pd(a[0], b[0]), self.sse2._mm_max_pd(a[1], b[1])]
    }

    #[inline(always)]
    fn abs_double(self, a: PairDouble) -> PairDouble {
        let sign = self.sse2._mm_set1_pd(-0.0);
        [self.sse2._mm_andnot_pd(sign, a[0]), self.sse2._mm_andnot_pd(sign, a[1])]
    }

    #[inline(always)]
    fn less_double(self, a: PairDouble, b: PairDouble) -> u32 {
        let low = self.sse2._mm_movemask_pd(self.sse2._mm_cmplt_pd(a[0], b[0])) as u32;
        let high = self.sse2._mm_movemask_pd(self.sse2._mm_cmplt_pd(a[1], b[1])) as u32;
        low | high << 2
    }

    #[inline(always)]
    fn prefetch(self, address: *const i8) {
        self.sse._mm_prefetch::<_MM_HINT_T0>(address);
    }
}
