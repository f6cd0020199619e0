//! Eight lanes in an array, vectorised by the compiler as the target allows.

use std::array::from_fn;

use super::{Half, Lanes, Row, Steps, WIDTH};

#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Lanes for Portable {
    type Float = Row;
    type Double = Half;

    #[inline(always)]
    fn splat(self, value: f32) -> Row {
        [value; 8]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn load_steps(self, row: &Steps) -> Row {
        row.map(f32::from)
    }

    #[inline(always)]
    fn store(self, a: Row) -> Row {
        a
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn mul_add(self, a: Row, b: Row, c: Row) -> Row {
        from_fn(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn mul_sub(self, a: Row, b: Row, c: Row) -> Row {
        from_fn(|i| a[i] * b[i] - c[i])
    }

    #[inline(always)]
    fn mul_sub_from(self, a: Row, b: Row, c: Row) -> Row {
        from_fn(|i| c[i] - a[i] * b[i])
    }

    #[inline(always)]
    fn min(self, a: Row, b: Row) -> Row {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max(self, a: Row, b: Row) -> Row {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn abs(self, a: Row) -> Row {
        a.map(f32::abs)
    }

    #[inline(always)]
    fn sqrt(self, a: Row) -> Row {
        a.map(f32::sqrt)
    }

    #[inline(always)]
    fn less_equal(self, a: Row, b: Row) -> u32 {
        (0..8).map(|i| u32::from(a[i] <= b[i]) << i).sum()
    }

    #[inline(always)]
    fn by_bit(self, bytes: &[u8; 4 * WIDTH]) -> [u32; WIDTH] {
        let mut numbers = [0; WIDTH];
        for (j, number) in numbers.iter_mut().enumerate() {
            for (i, byte) in bytes.iter().enumerate() {
                *number |= u32::from(byte >> j & 1) << i;
            }
        }
        numbers
    }

    #[inline(always)]
    fn splat_double(self, value: f64) -> Half {
        [value; 4]
    }

    #[inline(always)]
    fn load_double(self, half: &Half) -> Half {
        *half
    }

    #[inline(always)]
    fn store_double(self, a: Half) -> Half {
        a
    }

    #[inline(always)]
    fn add_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn div_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| a[i] / b[i])
    }

    #[inline(always)]
    fn min_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max_double(self, a: Half, b: Half) -> Half {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn abs_double(self, a: Half) -> Half {
        a.map(f64::abs)
    }

    #[inline(always)]
    fn less_double(self, a: Half, b: Half) -> u32 {
        (0..4).map(|i| u32::from(a[i] < b[i]) << i).sum()
    }

    #[inline(always)]
    fn prefetch(self, _: *const i8) {}
}
