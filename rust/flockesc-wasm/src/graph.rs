//! `componentLabels` and `neighborPairs`: the neighbor graph of a flock at one time.

use flockesc_core::{Error, FlockConfig, NeighborGraph, Result};
use wasm_bindgen::prelude::*;

/// Returns the lowest index of an agent in the weakly connected component of every agent. Positions in m and
/// velocities in m/s are flat arrays; there is one range in m, or one per agent.
///
/// # Errors
/// An error that names the argument, if the scenario is not valid, an array has the wrong length, or a range is
/// negative or not finite.
#[wasm_bindgen(js_name = componentLabels)]
pub fn component_labels(
    scenario: &str,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    interaction_range: Vec<f64>,
) -> std::result::Result<Vec<u32>, JsError> {
    let arguments = arguments(scenario, positions, velocities, interaction_range)?;
    Ok(arguments.component_labels()?)
}

/// Returns all pairs i, j of agents such that agent i listens to agent j, as a flat array in ascending order.
///
/// # Errors
/// As `componentLabels`.
#[wasm_bindgen(js_name = neighborPairs)]
pub fn neighbor_pairs(
    scenario: &str,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    interaction_range: Vec<f64>,
) -> std::result::Result<Vec<u32>, JsError> {
    let pairs = arguments(scenario, positions, velocities, interaction_range)?.pairs()?;
    Ok(pairs.into_iter().flat_map(<[u32; 2]>::from).collect())
}

fn arguments(
    scenario: &str,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    ranges: Vec<f64>,
) -> Result<NeighborGraph> {
    let scenario = FlockConfig::from_json(scenario)?;
    let dimension = scenario.dimension;
    let numbers = |count: usize| format!("{count} numbers");
    if positions.is_empty() || !positions.len().is_multiple_of(dimension) {
        let expected = format!("{dimension} numbers per agent");
        return Err(Error::input(
            "positions",
            expected,
            numbers(positions.len()),
        ));
    }
    if velocities.len() != positions.len() {
        let (expected, given) = (numbers(positions.len()), numbers(velocities.len()));
        return Err(Error::input("velocities", expected, given));
    }
    Ok(NeighborGraph {
        scenario: Some(scenario),
        dimension,
        positions,
        velocities,
        ranges,
    })
}
