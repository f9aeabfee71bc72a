//! Correctly rounded sums of rewards. They do not depend on the order of the terms.

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
}
