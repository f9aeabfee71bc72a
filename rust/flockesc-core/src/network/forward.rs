//! `forward`: the layers of a network, for [`LANES`] rows together. Every row has a lane, and the
//! order of the additions is the same in every lane.

use multiversion::multiversion;

use super::architecture::Activation;
use super::tanh::tanh;
use crate::base::error::{Error, Result};
use crate::parallel::Progress;

/// Number of rows that are computed together.
pub(super) const LANES: usize = 16;

/// Number of multiplications that take as long as the visit of an agent.
const PRODUCTS: usize = 64;

/// One number per row.
pub(super) type Lanes = [f64; LANES];

/// Replaces the inputs in `values` by the outputs of the layers. `shapes` has the numbers of inputs
/// and outputs of every layer. `values` and `scratch` are at least as long as the widest layer.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn forward(
    shapes: &[(usize, usize)],
    activation: Activation,
    parameters: &[f64],
    values: &mut [Lanes],
    scratch: &mut [Lanes],
) {
    let mut parameters = parameters;
    for (layer, &(rows, columns)) in shapes.iter().enumerate() {
        let (weights, rest) = parameters.split_at(rows * columns);
        let (biases, rest) = rest.split_at(columns);
        parameters = rest;
        let inputs = &values[..rows];
        for (column, (sum, bias)) in scratch.iter_mut().zip(biases).enumerate() {
            let mut lanes = [*bias; LANES];
            for (row, input) in inputs.iter().enumerate() {
                let weight = weights[row * columns + column];
                for lane in 0..LANES {
                    lanes[lane] += input[lane] * weight;
                }
            }
            *sum = lanes;
        }
        values[..columns].copy_from_slice(&scratch[..columns]);
        if layer + 1 < shapes.len() {
            match activation {
                Activation::Tanh => squash(&mut values[..columns]),
                Activation::Relu => rectify(&mut values[..columns]),
            }
        }
    }
}

/// Returns the work of `rows` rows in a network with `size` parameters, as a number of visited agents that take as
/// long.
pub fn work(rows: usize, size: usize) -> usize {
    rows.saturating_mul(1 + size / PRODUCTS)
}

/// Returns the outputs of a network with layers of these widths for every row of `inputs`: tanh layers, then a
/// linear one. Each layer has its weights, one row per input, and then its biases in `parameters`.
///
/// # Errors
/// [`Error::Input`] if `parameters` or `inputs` has the wrong length; [`Error::Interrupted`] if `progress` was
/// cancelled.
pub fn tanh_layers(
    widths: &[usize],
    parameters: &[f64],
    inputs: &[f64],
    progress: &Progress,
) -> Result<Vec<f64>> {
    let shapes: Vec<_> = widths.windows(2).map(|pair| (pair[0], pair[1])).collect();
    let size: usize = shapes
        .iter()
        .map(|(rows, columns)| (rows + 1) * columns)
        .sum();
    let [entries, .., columns] = *widths else {
        return Err(Error::input("widths", "at least two", widths.len()));
    };
    if parameters.len() != size || !inputs.len().is_multiple_of(entries) {
        let expected = format!("{size} numbers, and inputs of {entries}");
        return Err(Error::input("parameters", expected, parameters.len()));
    }
    let width = widths.iter().copied().max().unwrap_or_default();
    let (mut values, mut scratch) = (vec![[0.0; LANES]; width], vec![[0.0; LANES]; width]);
    let mut outputs = Vec::with_capacity(inputs.len() / entries * columns);
    for rows in inputs.chunks(LANES * entries) {
        progress.check()?;
        for (lane, row) in rows.chunks_exact(entries).enumerate() {
            for (value, number) in values.iter_mut().zip(row) {
                value[lane] = *number;
            }
        }
        forward(
            &shapes,
            Activation::Tanh,
            parameters,
            &mut values,
            &mut scratch,
        );
        for lane in 0..rows.len() / entries {
            outputs.extend(values[..columns].iter().map(|value| value[lane]));
        }
    }
    Ok(outputs)
}

/// Replaces every value by its tanh.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn squash(values: &mut [Lanes]) {
    for value in values.as_flattened_mut() {
        *value = tanh(*value);
    }
}

/// Replaces every negative value by 0.
#[inline(always)]
fn rectify(values: &mut [Lanes]) {
    for value in values.as_flattened_mut() {
        *value = if *value > 0.0 { *value } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the outputs for one row, computed by plain loops.
    fn reference(
        shapes: &[(usize, usize)],
        activation: Activation,
        parameters: &[f64],
        mut values: Vec<f64>,
    ) -> Vec<f64> {
        let function = match activation {
            Activation::Tanh => libm::tanh,
            Activation::Relu => |sum: f64| sum.max(0.0),
        };
        let mut parameters = parameters.iter();
        for (layer, &(rows, columns)) in shapes.iter().enumerate() {
            let weights: Vec<f64> = parameters.by_ref().take(rows * columns).copied().collect();
            let mut sums: Vec<f64> = parameters.by_ref().take(columns).copied().collect();
            for (row, value) in values.iter().enumerate() {
                for (column, sum) in sums.iter_mut().enumerate() {
                    *sum += value * weights[row * columns + column];
                }
            }
            let is_last = layer + 1 == shapes.len();
            values = if is_last {
                sums
            } else {
                sums.into_iter().map(function).collect()
            };
        }
        values
    }

    proptest! {
        #[test]
        fn every_lane_is_bitwise_equal_to_plain_loops(
            widths in prop::collection::vec(1..20_usize, 2..5),
            activation in prop::sample::select(vec![Activation::Tanh, Activation::Relu]),
            numbers in prop::collection::vec(-3.0..3.0_f64, 2000),
        ) {
            let shapes: Vec<_> = widths.windows(2).map(|pair| (pair[0], pair[1])).collect();
            let mut numbers = numbers.iter().copied().cycle();
            let mut row = || std::array::from_fn(|_| numbers.next().unwrap_or(0.0));
            let inputs: Vec<Lanes> = (0..20).map(|_| row()).collect();
            let parameters: Vec<f64> = numbers.take(2000).collect();
            let (mut values, mut scratch) = (inputs.clone(), inputs.clone());
            forward(&shapes, activation, &parameters, &mut values, &mut scratch);
            for lane in 0..LANES {
                let row = inputs[..widths[0]].iter().map(|input| input[lane]).collect();
                let expected = reference(&shapes, activation, &parameters, row);
                let found = values[..expected.len()].iter().map(|value| value[lane]);
                let found: Vec<f64> = found.collect();
                prop_assert_eq!(found, expected);
            }
        }
    }
}
