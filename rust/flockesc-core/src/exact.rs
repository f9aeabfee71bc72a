//! Sums that do not depend on their order: numbers become whole multiples of a power of two, and whole numbers add
//! exactly. So every algorithm, instruction set and number of threads gives the same bits.

/// 1.5 * 2^52: added to a number of at most 2^51, it leaves the nearest whole number in the low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// Bits that a rounded number may take.
const BITS: i32 = 51;

/// The power of two of which numbers are taken as whole multiples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    up: f64,
    down: f64,
}

impl Scale {
    /// The finest scale on which `terms` numbers of magnitude up to `largest` can be summed.
    pub(crate) fn new(largest: f64, terms: usize) -> Self {
        let room = 62 - (usize::BITS - terms.leading_zeros()) as i32;
        // Numbers below 2^-971 are rounded more coarsely, so that both powers stay finite.
        let exponent = (room.min(BITS) - exponent(largest)).min(1022);
        let up = power_of_two(exponent);
        Self {
            up,
            down: up.recip(),
        }
    }

    /// `value` in units of this scale, rounded to the nearest.
    #[inline(always)]
    pub(crate) fn quantize(self, value: f64) -> i64 {
        (value * self.up + SHIFT)
            .to_bits()
            .wrapping_sub(SHIFT.to_bits()) as i64
    }

    /// What `sum` units are worth.
    #[inline(always)]
    pub(crate) fn value(self, sum: i64) -> f64 {
        sum as f64 * self.down
    }
}

/// The smallest e with `largest` < 2^e.
fn exponent(largest: f64) -> i32 {
    ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1022
}

/// 2^exponent, for exponents from -1022 to 1023.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sums_are_exact_and_free_of_order(
            mut values in prop::collection::vec(-1e3..1e3_f64, 1..400),
            magnitude in -290..290_i32,
        ) {
            for value in &mut values {
                *value *= 10f64.powi(magnitude);
            }
            let largest = values.iter().fold(0.0, |l: f64, v| l.max(v.abs()));
            let scale = Scale::new(largest, values.len());
            let total = |values: &[f64]| values.iter().map(|v| scale.quantize(*v)).sum::<i64>();
            let sum = total(&values);
            let plain: f64 = values.iter().sum();
            prop_assert!((scale.value(sum) - plain).abs() <= 1e-15 * largest * values.len() as f64);
            values.reverse();
            prop_assert_eq!(total(&values), sum);
        }
    }

    #[test]
    fn the_extremes_stay_finite() {
        for largest in [0.0, f64::MIN_POSITIVE, 1.0, 2.0, f64::MAX] {
            for terms in [1, 300, 10_000_000] {
                let scale = Scale::new(largest, terms);
                let units = scale.quantize(-largest);
                assert!(units.unsigned_abs() <= 1 << BITS);
                assert!(units.checked_mul(terms as i64).is_some());
                assert_eq!(scale.value(units), if largest < 1.0 { scale.value(units) } else { -largest });
            }
        }
    }
}
