//! Observation of a line: its sorted offsets from the predator, and what one step under a candidate range would do.

use crate::base::entry::{Entries, Entry, Row};
use crate::line::step::Line;

/// Number of other components whose scaled value is 1/2.
const HALF_COUNT: f64 = 8.0;

/// Adds all entries to `row`. `scalars` are the elapsed fraction, the escape distance and the last range as a
/// fraction of the largest one.
fn add(
    row: &mut impl Row<f64>,
    [time, escape_distance, last_range]: [f64; 3],
    offsets: impl Iterator<Item = f64>,
    profile: impl Iterator<Item = Response>,
) {
    row.number("time", 0.0, time);
    row.number("escape_distance", 0.0, scaled(escape_distance));
    row.number("last_range", 0.0, last_range);
    for (rank, offset) in offsets.enumerate() {
        row.number(format_args!("offset_{rank}"), -1.0, scaled(offset));
    }
    for (k, response) in profile.enumerate() {
        let others = response.num_components.saturating_sub(1) as f64;
        row.begin_candidate(k);
        row.number("escape_distance", 0.0, scaled(response.escape_distance));
        row.number("flight_distance", 0.0, scaled(response.flight_distance));
        row.number("mean_offset", -1.0, scaled(response.mean_offset));
        row.number("num_components", 0.0, others / (others + HALF_COUNT));
        row.number("is_steady", 0.0, f64::from(response.is_steady));
    }
}

/// What one step under a candidate range would do.
#[derive(Clone, Default)]
struct Response {
    escape_distance: f64,
    /// The escape distance after one more step with a range of 0.
    flight_distance: f64,
    /// Mean of the offsets x_i - x_p.
    mean_offset: f64,
    num_components: usize,
    is_steady: bool,
}

impl Response {
    fn of(line: &Line, range: f64) -> Self {
        let mut next = line.clone();
        let moved = next.move_under(range);
        let mut response = Self {
            escape_distance: next.escape_distance(),
            flight_distance: 0.0,
            mean_offset: next.offsets().sum::<f64>() / line.config().num_agents as f64,
            num_components: next.num_components(range),
            is_steady: line.is_steady(moved),
        };
        next.move_under(0.0);
        response.flight_distance = next.escape_distance();
        response
    }
}

/// Scales an offset or distance u to u / (1 + |u|).
fn scaled(offset: f64) -> f64 {
    offset / (1.0 + offset.abs())
}

/// Returns the observation; `time` and `last_range` are fractions.
pub(super) fn observe(line: &Line, time: f64, last_range: f64, candidates: &[f64]) -> Vec<f32> {
    let mut observation = Vec::new();
    let scalars = [time, line.escape_distance(), last_range];
    let profile = candidates.iter().map(|range| Response::of(line, *range));
    add(&mut observation, scalars, line.offsets(), profile);
    observation
}

/// Returns the names and bounds of a line's observation entries, in order.
#[must_use]
pub fn line_entries(num_agents: usize, num_profile_ranges: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    let offsets = std::iter::repeat_n(0.0, num_agents);
    let profile = vec![Response::default(); num_profile_ranges];
    add(&mut entries, [0.0; 3], offsets, profile.into_iter());
    entries.entries
}
