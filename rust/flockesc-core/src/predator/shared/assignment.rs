//! Assignment of distinct agents to predators with the smallest sum of distances (Hungarian algorithm).

use nalgebra::SVector;
use pathfinding::prelude::{Matrix, kuhn_munkres};

use super::prey::{Prey, PreyAgent};
use crate::base::exact::Scale;

/// Largest number of predators with assigned targets. The cost matrix has up to `MAX_ASSIGNED`^3 entries.
pub(crate) const MAX_ASSIGNED: usize = 64;

/// Assigns a distinct agent to each of at least two `places`. If there are fewer agents than places, the
/// remaining places get their nearest agent.
pub(crate) fn assign<const D: usize>(
    places: &[SVector<f64, D>],
    prey: Prey<'_, D>,
) -> Vec<Option<PreyAgent<D>>> {
    // With n predators, an optimal assignment needs only the n nearest agents of each predator.
    let nearest: Vec<_> = places
        .iter()
        .map(|r| prey.nearest_few(r, places.len()))
        .collect();
    let mut targets: Vec<Option<PreyAgent<D>>> =
        nearest.iter().map(|few| few.first().copied()).collect();
    let mut candidates: Vec<PreyAgent<D>> = nearest.into_iter().flatten().collect();
    candidates.sort_unstable_by_key(|candidate| candidate.id);
    candidates.dedup_by_key(|candidate| candidate.id);

    let distance = |place: usize, candidate: usize| {
        let offset: SVector<f64, D> = candidates[candidate].position - places[place];
        offset.norm().min(f64::MAX)
    };
    // Costs are integers, so that sums do not depend on their order. The scale leaves room for the
    // algorithm's sums.
    let pairs = (0..places.len()).flat_map(|p| (0..candidates.len()).map(move |q| (p, q)));
    let largest = pairs.map(|(p, q)| distance(p, q)).fold(0.0, f64::max);
    let scale = Scale::new(largest, 8 * MAX_ASSIGNED);
    let gain = |place, candidate| -scale.truncate(distance(place, candidate));
    if places.len() <= candidates.len() {
        let gains = Matrix::from_fn(places.len(), candidates.len(), |(p, q)| gain(p, q));
        for (target, candidate) in targets.iter_mut().zip(kuhn_munkres(&gains).1) {
            *target = Some(candidates[candidate]);
        }
    } else {
        let gains = Matrix::from_fn(candidates.len(), places.len(), |(q, p)| gain(p, q));
        for (candidate, place) in candidates.iter().zip(kuhn_munkres(&gains).1) {
            targets[place] = Some(*candidate);
        }
    }
    targets
}
