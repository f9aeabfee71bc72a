//! The Voronoi neighbor rule in the plane, by Delaunay triangulation.
//!
//! Two agents are neighbors if their cells share an edge of positive length. Points on a common circle have
//! several triangulations; some of their edges belong to cells that meet only in a point. Exact predicates
//! find and remove these edges. Agents at the same point share a cell: they are neighbors of each other and
//! have the same other neighbors.

use nalgebra::SVector;
use robust::{Coord, incircle};
use spade::{DelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

use crate::agents::Agents;
use crate::base::check::require;
use crate::base::error::Result;
use crate::neighbor::engine::lists::Lists;

/// Checks that the rule is defined in a world with this dimension and periodic side.
pub(super) fn check(dimension: usize, periodic_side: Option<f64>) -> Result<()> {
    let expected = format!("a rule for {dimension} dimensions");
    require(dimension == 2, "neighbor_rule", &expected, "voronoi")?;
    let (is_open, expected) = (periodic_side.is_none(), "None with neighbor_rule voronoi");
    require(
        is_open,
        "periodic_side",
        expected,
        periodic_side.unwrap_or_default(),
    )
}

/// Returns every agent's Voronoi neighbors, the agent itself excluded. Agents with a coordinate above 2^201 m
/// have only neighbors at the same point.
pub(super) fn neighbors<const D: usize>(agents: &Agents<D>) -> Lists {
    // Agents that are close in space are close in memory, so that the search for the triangle of the next point
    // starts near it.
    let mut triangulation = DelaunayTriangulation::<Point2<f64>>::new();
    // Pairs of a site, which is the index of a vertex, and an agent at this point.
    let mut members = Vec::with_capacity(agents.len());
    let mut distant = Vec::new();
    for agent in agents.iter() {
        let point = rounded(&agent.position);
        match triangulation.insert(point) {
            Ok(vertex) => members.push((vertex.index(), agent.id)),
            Err(_) => distant.push((point, agent.id)),
        }
    }
    distant.sort_unstable_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let distant_sites = distant.chunk_by(|(a, _), (b, _)| a == b);
    for (index, site) in (agents.len()..).zip(distant_sites) {
        members.extend(site.iter().map(|&(_, id)| (index, id)));
    }
    members.sort_unstable();
    let sites: Vec<&[(usize, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    let mut pairs = Vec::with_capacity(6 * agents.len());
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
    for (one, other) in shared_edges(&triangulation) {
        link(one, other);
        link(other, one);
    }
    pairs.retain(|(id, other)| id != other);
    Lists::new(agents.num_agents(), &pairs, Vec::new())
}

/// Returns the position in the form that the triangulation accepts: tiny coordinates and -0 become 0.
fn rounded<const D: usize>(position: &SVector<f64, D>) -> Point2<f64> {
    let Point2 { x, y } = mitigate_underflow(Point2::new(position[0], position[1]));
    Point2::new(x + 0.0, y + 0.0)
}

/// Returns the pairs of sites whose cells share an edge of positive length.
fn shared_edges(
    triangulation: &DelaunayTriangulation<Point2<f64>>,
) -> impl Iterator<Item = (usize, usize)> {
    triangulation.undirected_edges().filter_map(|edge| {
        let directed = edge.as_directed();
        let apexes = (
            directed.opposite_position(),
            directed.rev().opposite_position(),
        );
        let is_point = matches!(apexes, (Some(left), Some(right)) if {
            let [a, b] = edge.positions();
            incircle(coord(a), coord(b), coord(left), coord(right)) == 0.0
        });
        let [one, other] = edge.vertices().map(|vertex| vertex.index());
        (!is_point).then_some((one, other))
    })
}

fn coord(point: Point2<f64>) -> Coord<f64> {
    Coord {
        x: point.x,
        y: point.y,
    }
}
