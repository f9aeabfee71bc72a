//! The Voronoi neighbor rule in the plane, by Delaunay triangulation.
//!
//! Two agents are neighbors if their cells share an edge of positive length. Points on a common circle have
//! several triangulations; some of their edges belong to cells that meet only in a point. Exact predicates
//! find and remove these edges. Agents at the same point share a cell: they are neighbors of each other and
//! have the same other neighbors.

use nalgebra::SVector;
use robust::{Coord, incircle};
use serde::{Deserialize, Serialize};
use spade::{
    DelaunayTriangulation, HasPosition, MAX_ALLOWED_VALUE, Point2, Triangulation,
    mitigate_underflow,
};

use super::rule::{Criterion, Found, Rule, Sensing};
use crate::agents::Agents;
use crate::base::error::{Error, Result};
use crate::neighbor::engine::lists::Lists;

/// The agents within the interaction range whose Voronoi cells share an edge with the agent's. For D = 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Voronoi {}

impl Rule for Voronoi {
    fn check(&self, dimension: usize, periodic_side: Option<f64>) -> Result<()> {
        if dimension != 2 {
            let expected = format!("a rule for {dimension} dimensions");
            return Err(Error::config("neighbor_rule", expected, "voronoi"));
        }
        match periodic_side {
            Some(side) => Err(Error::config(
                "periodic_side",
                "None with neighbor_rule voronoi",
                side,
            )),
            None => Ok(()),
        }
    }

    fn criterion(&self) -> Criterion {
        Criterion::List
    }

    fn find<const D: usize>(&self, sensing: &Sensing<'_, D>, found: &mut Found) {
        found.square_ranges(sensing);
        found.lists = voronoi_neighbors(sensing.agents);
    }
}

/// A point with one or more agents.
struct Site {
    position: Point2<f64>,
    /// Index of the site.
    index: usize,
}

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Returns every agent's Voronoi neighbors, the agent itself excluded. Agents with a coordinate above 2^201 m
/// have only neighbors at the same point.
fn voronoi_neighbors<const D: usize>(agents: &Agents<D>) -> Lists {
    let mut points: Vec<(Point2<f64>, u32)> = agents
        .iter()
        .map(|(id, position, _)| (rounded(&position), id as u32))
        .collect();
    points.sort_unstable_by(|(a, one), (b, other)| {
        let by_place = a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y));
        by_place.then(one.cmp(other))
    });
    let sites: Vec<&[(Point2<f64>, u32)]> = points.chunk_by(|a, b| a.0 == b.0).collect();
    let mut pairs = Vec::with_capacity(6 * points.len());
    let mut link = |one: usize, other: usize| {
        for &(_, id) in sites[one] {
            pairs.extend(sites[other].iter().map(|&(_, other)| (id, other)));
        }
    };
    for (index, site) in sites.iter().enumerate() {
        if site.len() > 1 {
            link(index, index);
        }
    }
    for (one, other) in shared_edges(&sites) {
        link(one, other);
        link(other, one);
    }
    pairs.retain(|(id, other)| id != other);
    Lists::new(agents.num_agents(), &pairs)
}

/// Returns the position in the form that the triangulation accepts: tiny coordinates and -0 become 0.
fn rounded<const D: usize>(position: &SVector<f64, D>) -> Point2<f64> {
    let Point2 { x, y } = mitigate_underflow(Point2::new(position[0], position[1]));
    Point2::new(x + 0.0, y + 0.0)
}

/// Returns the pairs of sites whose cells share an edge of positive length.
fn shared_edges(sites: &[&[(Point2<f64>, u32)]]) -> Vec<(usize, usize)> {
    let is_allowed = |point: &Point2<f64>| {
        point.x.abs() <= MAX_ALLOWED_VALUE && point.y.abs() <= MAX_ALLOWED_VALUE
    };
    let places = sites.iter().map(|site| site[0].0).enumerate();
    let vertices = places
        .filter(|(_, position)| is_allowed(position))
        .map(|(index, position)| Site { position, index })
        .collect();
    // The triangulation rejects only invalid coordinates, which were removed above.
    let Ok(triangulation) = DelaunayTriangulation::<Site>::bulk_load(vertices) else {
        return Vec::new();
    };
    triangulation
        .undirected_edges()
        .filter_map(|edge| {
            let directed = edge.as_directed();
            let apexes = (
                directed.opposite_position(),
                directed.rev().opposite_position(),
            );
            let is_point = matches!(apexes, (Some(left), Some(right)) if {
                let [a, b] = edge.positions();
                incircle(coord(a), coord(b), coord(left), coord(right)) == 0.0
            });
            let [one, other] = edge.vertices().map(|vertex| vertex.data().index);
            (!is_point).then_some((one, other))
        })
        .collect()
}

fn coord(point: Point2<f64>) -> Coord<f64> {
    Coord {
        x: point.x,
        y: point.y,
    }
}
