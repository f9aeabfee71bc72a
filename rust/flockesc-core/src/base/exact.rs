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
    /// The finest scale on which `terms` numbers of magnitude up to `largest` can be summed, at least 1 of them.
    pub(crate) fn new(largest: f64, terms: usize) -> Self {
        Self::with_bits(room(terms), largest)
    }

    /// As [`Scale::new`], but coarse enough for [`Scale::quantize`]: at best `largest` / 2^51.
    pub(crate) fn for_registers(largest: f64, terms: usize) -> Self {
        Self::with_bits(room(terms).min(BITS), largest)
    }

    /// The scale of this [unit](Scale::unit); `None` for what is the unit of none.
    pub(crate) fn of_unit(unit: f64) -> Option<Self> {
        let up = unit.recip();
        let is_power = |number: f64| number.is_normal() && number.to_bits() << 12 == 0;
        (unit > 0.0 && is_power(unit) && is_power(up)).then_some(Self { up, down: unit })
    }

    /// What one unit is worth.
    pub(crate) fn unit(self) -> f64 {
        self.down
    }

    /// Numbers below `largest` take `bits` bits.
    fn with_bits(bits: i32, largest: f64) -> Self {
        // The smallest e with `largest` < 2^e.
        let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1022;
        // Both powers stay normal: where all numbers are below 2^-971, they are taken more coarsely.
        let up = power_of_two((bits - exponent).min(1022));
        Self {
            up,
            down: up.recip(),
        }
    }

    /// `value` in units of a scale [`for_registers`](Scale::for_registers), rounded to the nearest. Unlike a cast, this
    /// is an addition, which every instruction set has in vector registers.
    #[inline(always)]
    pub(crate) fn quantize(self, value: f64) -> i64 {
        (value * self.up + SHIFT)
            .to_bits()
            .wrapping_sub(SHIFT.to_bits()) as i64
    }

    /// `value` in units of any scale, rounded toward 0.
    #[inline(always)]
    pub(crate) fn truncate(self, value: f64) -> i64 {
        (value * self.up) as i64
    }

    /// What `sum` units are worth.
    #[inline(always)]
    pub(crate) fn value(self, sum: i64) -> f64 {
        sum as f64 * self.down
    }

    /// What `units` are worth.
    #[inline(always)]
    pub(crate) fn of(self, units: f64) -> f64 {
        units * self.down
    }

    /// What `sum` units are worth, shared by `count`. The quotient first: a sum may be beyond every f64.
    #[inline(always)]
    pub(crate) fn mean(self, sum: i64, count: i64) -> f64 {
        sum as f64 / count as f64 * self.down
    }
}

/// Bits that each of so many numbers may take in a sum of 63.
fn room(terms: usize) -> i32 {
    terms.leading_zeros() as i32 - 1
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
            let scale = Scale::for_registers(largest, values.len());
            let total = |values: &[f64]| values.iter().map(|v| scale.quantize(*v)).sum::<i64>();
            let sum = total(&values);
            let plain: f64 = values.iter().sum();
            prop_assert!((scale.value(sum) - plain).abs() <= 1e-15 * largest * values.len() as f64);
            values.reverse();
            prop_assert_eq!(total(&values), sum);
        }
    }

    #[test]
    fn no_sum_overflows_and_none_is_coarse() {
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
