//! The hyperbolic tangent without branches. The compiler can therefore vectorize it.

/// ln 2 as a sum of two numbers, and 1 / ln 2.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
const INVERSE_LN2: f64 = std::f64::consts::LOG2_E;

/// Coefficients of the rational function in `expm1`.
const Q: [f64; 5] = [
    -3.333_333_333_333_313e-2,
    1.587_301_587_254_814_6e-3,
    -7.936_507_578_674_88e-5,
    4.008_217_827_329_362e-6,
    -2.010_992_181_836_243_7e-7,
];

/// 1.5 * 2^52. The sum of it and an integer from -2^51 to 2^51 has that integer in its low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// tanh(x) rounds to 1 for all x >= 19.5.
const SATURATED: f64 = 19.5;

/// Bounds of the three formulas for tanh (`MIDDLE`, `LARGE`), and of the reduction in `expm1`. libm compares
/// the upper 32 bits of x with constants; these are the smallest numbers beyond those constants.
const MIDDLE: f64 = f64::from_bits(0x3fd0_58af << 32);
const LARGE: f64 = f64::from_bits(0x3fe1_93eb << 32);
const REDUCED: f64 = f64::from_bits(0x3fd6_2e43 << 32);

/// Returns the bits of `libm::tanh(x)`. The operations are the same, with selections instead of
/// branches.
#[inline(always)]
pub(super) fn tanh(x: f64) -> f64 {
    let size = x.abs();
    let size = if size > SATURATED { SATURATED } else { size };
    // The sign is changed by arithmetic, because the compiler would compute expm1 twice for a
    // selection.
    let sign = u64::from(size < MIDDLE) << 63;
    let negated_if_small = |value: f64| f64::from_bits(value.to_bits() ^ sign);
    let t = expm1(negated_if_small(2.0 * size));
    let numerator = if size >= LARGE {
        2.0
    } else {
        negated_if_small(t)
    };
    let quotient = numerator / (t + 2.0);
    let value = if size >= LARGE {
        1.0 - quotient
    } else {
        quotient
    };
    value.copysign(x)
}

/// Returns the bits of `libm::expm1(x)` for the x that `tanh` needs: from -0.52 to 0, and from 0.51 to 39.
/// libm has separate formulas for k = -1, 0 and 1. For these x they round to the same numbers, because a product
/// with 2^k is exact, and c is 0 for k = 0.
#[inline(always)]
fn expm1(x: f64) -> f64 {
    // x = k ln 2 + reduced + c.
    let k = if x.abs() < REDUCED {
        0.0
    } else {
        (INVERSE_LN2 * x + 0.5).floor()
    };
    let (high, low) = (x - k * LN2_HIGH, k * LN2_LOW);
    let reduced = high - low;
    let c = (high - reduced) - low;
    let half = 0.5 * reduced;
    let square = reduced * half;
    let series =
        1.0 + square * (Q[0] + square * (Q[1] + square * (Q[2] + square * (Q[3] + square * Q[4]))));
    let t = 3.0 - series * half;
    let e = square * ((series - t) / (6.0 - reduced * t));
    let e = reduced * (e - c) - c - square;
    let (power, inverse) = (two_to_the(k), two_to_the(-k));
    let (e, one) = if k < 20.0 {
        (e, 1.0 - inverse)
    } else {
        (e + inverse, 1.0)
    };
    ((reduced - e) + one) * power
}

/// Returns 2^k for integers k from -1022 to 1023.
#[inline(always)]
fn two_to_the(k: f64) -> f64 {
    f64::from_bits((k + (SHIFT + 1023.0)).to_bits() << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asserts that the bits are those of libm for x and -x.
    fn assert_same(x: f64) {
        for x in [x, -x] {
            assert_eq!(tanh(x).to_bits(), libm::tanh(x).to_bits(), "tanh({x:?})");
        }
    }

    #[test]
    fn it_is_bitwise_equal_to_libm_where_the_formula_changes() {
        let bounds = [
            0.0,
            f64::MIN_POSITIVE,
            2f64.powi(-60),
            2f64.powi(-54),
            MIDDLE,
            REDUCED / 2.0,
            LARGE,
            0.75 * std::f64::consts::LN_2,
            SATURATED,
            20.0,
            22.0,
            710.0,
            f64::MAX,
        ];
        for bound in bounds {
            for step in -1000..1000_i64 {
                let bits = bound.to_bits() as i64 + step;
                if bits >= 0 && (bits as u64) < f64::INFINITY.to_bits() {
                    assert_same(f64::from_bits(bits as u64));
                }
            }
        }
        assert_same(f64::INFINITY);
        for k in 0..60 {
            for step in -200..200 {
                assert_same(
                    (f64::from(k) / 2.0 + 0.25) * std::f64::consts::LN_2 + f64::from(step) * 1e-15,
                );
                assert_same(f64::from(k) * 0.5 * std::f64::consts::LN_2 + f64::from(step) * 1e-15);
            }
        }
    }

    #[test]
    fn it_is_bitwise_equal_to_libm_on_a_grid() {
        for step in 0..1_000_000 {
            assert_same(f64::from(step) * 2.13e-5);
        }
    }
}
