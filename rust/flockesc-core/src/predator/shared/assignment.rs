//! The assignment of distinct agents to predators with the smallest sum of distances.

use nalgebra::SVector;
use pathfinding::prelude::{Matrix, kuhn_munkres};

use crate::base::exact::Scale;
use crate::predator::shared::prey::{Prey, Quarry};

/// Most predators with assigned targets: their distances to all agents that matter are `MAX_ASSIGNED`^3 numbers.
pub(in crate::predator) const MAX_ASSIGNED: usize = 64;

/// A distinct agent for each of at least two `places`; the nearest agent for places that get none.
pub(in crate::predator) fn assign<const D: usize>(
    places: &[SVector<f64, D>],
    prey: Prey<'_, D>,
) -> Vec<Option<Quarry<D>>> {
    // As many agents as there are predators always leave one for the last to choose: none needs to go farther.
    let nearest: Vec<_> = places
        .iter()
        .map(|r| prey.nearest_few(r, places.len()))
        .collect();
    let mut targets: Vec<Option<Quarry<D>>> =
        nearest.iter().map(|few| few.first().copied()).collect();
    let mut quarries: Vec<Quarry<D>> = nearest.into_iter().flatten().collect();
    quarries.sort_unstable_by_key(|quarry| quarry.id);
    quarries.dedup_by_key(|quarry| quarry.id);

    let distance = |place: usize, quarry: usize| {
        let offset: SVector<f64, D> = quarries[quarry].position - places[place];
        offset.norm().min(f64::MAX)
    };
    // Whole numbers, which add up the same in every order; room for the sums of the search as well.
    let pairs = (0..places.len()).flat_map(|p| (0..quarries.len()).map(move |q| (p, q)));
    let largest = pairs.map(|(p, q)| distance(p, q)).fold(0.0, f64::max);
    let scale = Scale::new(largest, 8 * MAX_ASSIGNED);
    let gain = |place, quarry| -scale.truncate(distance(place, quarry));
    if places.len() <= quarries.len() {
        let gains = Matrix::from_fn(places.len(), quarries.len(), |(p, q)| gain(p, q));
        for (target, quarry) in targets.iter_mut().zip(kuhn_munkres(&gains).1) {
            *target = Some(quarries[quarry]);
        }
    } else {
        let gains = Matrix::from_fn(quarries.len(), places.len(), |(q, p)| gain(p, q));
        for (quarry, place) in quarries.iter().zip(kuhn_munkres(&gains).1) {
            targets[place] = Some(*quarry);
        }
    }
    targets
}
