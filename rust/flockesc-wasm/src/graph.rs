//! `neighborPairs`: the neighbor graph of a flock at one time.

use flockesc_core::{Error, FlockConfig, NeighborGraph};
use wasm_bindgen::prelude::*;

/// Returns all pairs i, j of agents such that agent i listens to agent j, as a flat array in ascending order.
/// Positions in m and velocities in m/s are flat arrays; there is one range in m, or one per agent.
///
/// # Errors
/// An error that names the argument, if the scenario is not valid, an array has the wrong length, or a range is
/// negative or not finite.
#[wasm_bindgen(js_name = neighborPairs)]
pub fn neighbor_pairs(
    scenario: &str,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    ranges: Vec<f64>,
) -> Result<Vec<u32>, JsError> {
    let scenario = FlockConfig::from_json(scenario)?;
    let dimension = scenario.dimension;
    let numbers = |count: usize| format!("{count} numbers");
    if positions.is_empty() || !positions.len().is_multiple_of(dimension) {
        let expected = format!("{dimension} numbers per agent");
        return Err(Error::input("positions", expected, numbers(positions.len())).into());
    }
    if velocities.len() != positions.len() {
        let (expected, given) = (numbers(positions.len()), numbers(velocities.len()));
        return Err(Error::input("velocities", expected, given).into());
    }
    let graph = NeighborGraph {
        scenario: Some(scenario),
        dimension,
        positions,
        velocities,
        ranges,
    };
    Ok(graph
        .pairs()?
        .into_iter()
        .flat_map(<[u32; 2]>::from)
        .collect())
}
