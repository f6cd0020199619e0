//! Eight lanes in one 256-bit register, with fused multiply–add.

use std::arch::x86_64::{__m256, __m256d, _CMP_LE_OQ, _CMP_LT_OQ, _MM_HINT_T0};

use pulp::NullaryFnOnce;
use pulp::x86::V3;

use super::{Half, Lanes, Row, Steps, Task, WIDTH};

/// A task compiled for AVX2.
pub(super) struct Vectorized<T>(pub(super) V3, pub(super) T);

impl<T: Task> NullaryFnOnce for Vectorized<T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.1.run(self.0)
    }
}

impl Lanes for V3 {
    type Float = __m256;
    type Double = __m256d;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        self.avx._mm256_set1_ps(value)
    }

    #[inline(always)]
    fn load(self, row: &Row) -> __m256 {
        pulp::cast(*row)
    }

    #[inline(always)]
    fn load_steps(self, row: &Steps) -> __m256 {
        self.avx._mm256_cvtepi32_ps(self.avx2._mm256_cvtepu16_epi32(pulp::cast(*row)))
    }

    #[inline(always)]
    fn store(self, a: __m256) -> Row {
        pulp::cast(a)
    }

    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_add_ps(a, b)
    }

    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_sub_ps(a, b)
    }

    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_mul_ps(a, b)
    }

    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.fma._mm256_fmadd_ps(a, b, c)
    }

    #[inline(always)]
    fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.fma._mm256_fmsub_ps(a, b, c)
    }

    #[inline(always)]
    fn mul_sub_from(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.fma._mm256_fnmadd_ps(a, b, c)
    }

    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_min_ps(a, b)
    }

    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_max_ps(a, b)
    }

    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        self.avx._mm256_andnot_ps(self.avx._mm256_set1_ps(-0.0), a)
    }

    #[inline(always)]
    fn sqrt(self, a: __m256) -> __m256 {
        self.avx._mm256_sqrt_ps(a)
    }

    #[inline(always)]
    fn less_equal(self, a: __m256, b: __m256) -> u32 {
        self.avx._mm256_movemask_ps(self.avx._mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32
    }

    #[inline(always)]
    fn by_bit(self, bytes: &[u8; 4 * WIDTH]) -> [u32; WIDTH] {
        let mut bytes = pulp::cast(*bytes);
        let mut numbers = [0; WIDTH];
        // The highest bit of each byte, then the next one.
        for number in numbers.iter_mut().rev() {
            *number = self.avx2._mm256_movemask_epi8(bytes) as u32;
            bytes = self.avx2._mm256_add_epi8(bytes, bytes);
        }
        numbers
    }

    #[inline(always)]
    fn splat_double(self, value: f64) -> __m256d {
        self.avx._mm256_set1_pd(value)
    }

    #[inline(always)]
    fn load_double(self, half: &Half) -> __m256d {
        pulp::cast(*half)
    }

    #[inline(always)]
    fn store_double(self, a: __m256d) -> Half {
        pulp::cast(a)
    }

    #[inline(always)]
    fn add_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_add_pd(a, b)
    }

    #[inline(always)]
    fn sub_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_sub_pd(a, b)
    }

    #[inline(always)]
    fn mul_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_mul_pd(a, b)
    }

    #[inline(always)]
    fn div_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_div_pd(a, b)
    }

    #[inline(always)]
    fn min_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_min_pd(a, b)
    }

    #[inline(always)]
    fn max_double(self, a: __m256d, b: __m256d) -> __m256d {
        self.avx._mm256_max_pd(a, b)
    }

    #[inline(always)]
    fn abs_double(self, a: __m256d) -> __m256d {
        self.avx._mm256_andnot_pd(self.avx._mm256_set1_pd(-0.0), a)
    }

    #[inline(always)]
    fn less_double(self, a: __m256d, b: __m256d) -> u32 {
        self.avx._mm256_movemask_pd(self.avx._mm256_cmp_pd::<_CMP_LT_OQ>(a, b)) as u32
    }

    #[inline(always)]
    fn prefetch(self, address: *const i8) {
        self.sse._mm_prefetch::<_MM_HINT_T0>(address);
    }
}
