//! Exact sums in fixed point. Numbers are rounded to integer multiples of a power of two, and integers add
//! exactly, so that a sum has the same bits in any order, on any instruction set and on any number of
//! threads.

use pulp::Simd;

/// 1.5 * 2^52. The sum of it and a number of magnitude at most 2^51 has the nearest integer in its low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// Number of bits of a quantized number.
const BITS: i32 = 51;

/// A fixed-point scale: one unit is a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    up: f64,
    down: f64,
}

impl Scale {
    /// Creates the finest scale on which `terms` >= 1 numbers of magnitude up to `largest` can be summed.
    pub(crate) fn new(largest: f64, terms: usize) -> Self {
        Self::with_bits(bits_per_term(terms), largest)
    }

    /// Creates a scale as [`Scale::new`] does, but with a unit of at least `largest` / 2^51, as
    /// [`Scale::quantize`] needs.
    pub(crate) fn for_registers(largest: f64, terms: usize) -> Self {
        Self::with_bits(bits_per_term(terms).min(BITS), largest)
    }

    /// Returns the scale whose [unit](Scale::unit) is `unit`, a power of two.
    pub(crate) fn of_unit(unit: f64) -> Self {
        Self {
            up: unit.recip(),
            down: unit,
        }
    }

    /// Returns the value of one unit.
    pub(crate) fn unit(self) -> f64 {
        self.down
    }

    /// Creates the scale on which numbers of magnitude up to `largest` have `bits` bits.
    fn with_bits(bits: i32, largest: f64) -> Self {
        // The smallest e with `largest` < 2^e.
        let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1022;
        // The limit keeps both powers normal; it makes the scale coarser if all numbers are below 2^-971.
        let up = power_of_two((bits - exponent).min(1022));
        Self {
            up,
            down: up.recip(),
        }
    }

    /// Returns the number of units nearest to `value`, for a scale made by [`Scale::for_registers`].
    /// This is an addition instead of a cast, because every instruction set vectorizes additions.
    #[inline(always)]
    pub(crate) fn quantize(self, value: f64) -> i64 {
        (value * self.up + SHIFT)
            .to_bits()
            .wrapping_sub(SHIFT.to_bits()) as i64
    }

    /// Returns a register of values as [`Scale::quantize`] does.
    #[inline(always)]
    pub(crate) fn quantize_register<S: Simd>(self, simd: S, values: S::f64s) -> S::u64s {
        let scaled = simd.mul_f64s(values, simd.splat_f64s(self.up));
        let shifted = simd.add_f64s(scaled, simd.splat_f64s(SHIFT));
        simd.sub_u64s(
            simd.transmute_u64s_f64s(shifted),
            simd.splat_u64s(SHIFT.to_bits()),
        )
    }

    /// Returns `value` in units of any scale, rounded toward 0.
    #[inline(always)]
    pub(crate) fn truncate(self, value: f64) -> i64 {
        (value * self.up) as i64
    }

    /// Returns the value of `sum` units.
    #[inline(always)]
    pub(crate) fn value(self, sum: i64) -> f64 {
        to_float(sum) * self.down
    }

    /// Converts a number of units, not necessarily an integer, into its value.
    #[inline(always)]
    pub(crate) fn value_of(self, units: f64) -> f64 {
        units * self.down
    }

    /// Returns the value of `sum` units divided by `count`. The division comes first, because the value of a
    /// sum may overflow.
    #[inline(always)]
    pub(crate) fn mean(self, sum: i64, count: i64) -> f64 {
        to_float(sum) / to_float(count) * self.down
    }
}

/// Returns the float nearest to `integer`, as a cast does. This is bit operations and a sum instead of a cast,
/// because AVX2 and older instruction sets convert integers one at a time.
#[inline(always)]
pub(crate) fn to_float(integer: i64) -> f64 {
    // The bits of 2^52 plus the lower half, and those of 2^84 + 2^63 plus the upper half times 2^32: both are exact.
    let low = (integer as u64 & 0xffff_ffff) | 0x4330_0000_0000_0000;
    let high = ((integer as u64) >> 32) ^ 0x4530_0000_8000_0000;
    // 2^84 + 2^63 + 2^52. The difference is exact, so that the sum is rounded once.
    let offset = f64::from_bits(0x4530_0000_8010_0000);
    (f64::from_bits(high) - offset) + f64::from_bits(low)
}

/// Returns the number of bits that each of `terms` numbers may have if their sum fits into 63 bits.
fn bits_per_term(terms: usize) -> i32 {
    // Not of a `usize`, which has 32 bits in WebAssembly.
    (terms as u64).leading_zeros() as i32 - 1
}

/// Returns 2^exponent, for exponents from -1022 to 1023.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Returns the correctly rounded sum of `values`, as Python's `math.fsum` does (Shewchuk, "Adaptive precision
/// floating-point arithmetic", 1997).
pub(crate) fn exact_sum(values: &[f64]) -> f64 {
    // Nonoverlapping numbers of increasing magnitude with the exact sum of the values so far.
    let mut parts: Vec<f64> = Vec::new();
    for &value in values {
        let (mut sum, mut kept) = (value, 0);
        for index in 0..parts.len() {
            let (total, rest) = two_sum(sum, parts[index]);
            if rest != 0.0 {
                parts[kept] = rest;
                kept += 1;
            }
            sum = total;
        }
        parts.truncate(kept);
        parts.push(sum);
    }
    let mut sum = parts.pop().unwrap_or(0.0);
    while let Some(part) = parts.pop() {
        let (total, rest) = two_sum(sum, part);
        sum = total;
        if rest != 0.0 {
            // If `rest` is half a unit in the last place of `sum`, the sign of the next part decides how to
            // round.
            let (away, error) = two_sum(sum, 2.0 * rest);
            let is_tie = error == 0.0;
            if is_tie && parts.last().is_some_and(|part| part * rest > 0.0) {
                sum = away;
            }
            break;
        }
    }
    sum
}

/// Returns the rounded sum of two numbers and its rounding error. The two results add to the exact sum.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let (large, small) = if a.abs() < b.abs() { (b, a) } else { (a, b) };
    let sum = large + small;
    (sum, small - (sum - large))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sums_are_correctly_rounded() {
        let power = |exponent| 2f64.powi(exponent);
        for (values, expected) in [
            (vec![], 0.0),
            (vec![1e16, 1.0, -1e16], 1.0),
            (vec![0.1; 10], 1.0),
            (vec![1e100, 1.0, -1e100, 1e-100, 1e50, -1.0, -1e50], 1e-100),
            (vec![power(53), -0.5, -power(-54)], power(53) - 1.0),
            (vec![power(53), 1.0, power(-100)], power(53) + 2.0),
            (vec![power(53), 1.0, -power(-100)], power(53)),
            (vec![power(53) + 10.0, 1.0, power(-100)], power(53) + 12.0),
            (vec![power(53) - 4.0, 0.5, power(-54)], power(53) - 3.0),
        ] {
            assert_eq!(exact_sum(&values), expected, "{values:?}");
        }
    }

    proptest! {
        #[test]
        fn sums_are_exact_and_independent_of_order(
            mut values in prop::collection::vec(-1e3..1e3_f64, 1..400),
            magnitude in -290..290_i32,
        ) {
            for value in &mut values {
                *value *= 10f64.powi(magnitude);
            }
            let largest = values.iter().fold(0.0, |l: f64, v| l.max(v.abs()));
            let scale = Scale::for_registers(largest, values.len());
            let total = |values: &[f64]| values.iter().map(|v| scale.quantize(*v)).sum::<i64>();
            let sum = total(&values);
            let plain: f64 = values.iter().sum();
            prop_assert!((scale.value(sum) - plain).abs() <= 1e-15 * largest * values.len() as f64);
            values.reverse();
            prop_assert_eq!(total(&values), sum);
        }
    }

    proptest! {
        #[test]
        fn floats_of_integers_equal_casts(integer: i64, shift in 0..63) {
            for integer in [integer, integer >> shift, i64::MIN, i64::MAX, 0, -1] {
                prop_assert_eq!(to_float(integer).to_bits(), (integer as f64).to_bits());
            }
        }
    }

    #[test]
    fn sums_do_not_overflow_and_keep_their_precision() {
        for largest in [0.0, f64::MIN_POSITIVE, 1.0, 1.5, 1e300] {
            for terms in [1, 2, 300, 10_000_000] {
                let fine = Scale::new(largest, terms);
                let coarse = Scale::for_registers(largest, terms);
                for (scale, units) in [
                    (fine, fine.truncate(-largest)),
                    (coarse, coarse.quantize(-largest)),
                ] {
                    let total = units.checked_mul(terms as i64).expect("no overflow");
                    assert!((scale.mean(total, terms as i64) + largest).abs() <= 1e-11 * largest);
                }
            }
        }
    }
}
