//! The profile of a line: what one step under a candidate range would do.

use crate::line::step::Line;

/// Number of other components whose scaled value is 1/2.
const HALF_COUNT: f64 = 8.0;

/// Names and lower bounds of the entries of one candidate range.
const ENTRIES: [(&str, f32); 5] = [
    ("escape_distance", 0.0),
    ("flight_distance", 0.0),
    ("mean_offset", -1.0),
    ("num_components", 0.0),
    ("is_steady", 0.0),
];

/// Returns the names and lower bounds of the entries of candidate range `k`.
pub(super) fn names(k: usize) -> [(String, f32); 5] {
    ENTRIES.map(|(name, low)| (format!("profile_{k}_{name}"), low))
}

/// Returns the entries of one candidate range, computed on copies of the line.
pub(super) fn values(line: &Line, range: f64) -> [f64; 5] {
    let mut next = line.clone();
    let moved = next.move_under(range);
    let (distance, mean) = (next.escape_distance(), mean_offset(&next));
    let others = (next.num_components(range) - 1) as f64;
    next.move_under(0.0);
    [
        scaled(distance),
        scaled(next.escape_distance()),
        scaled(mean),
        others / (others + HALF_COUNT),
        f64::from(line.is_steady(moved)),
    ]
}

/// Returns the mean of the offsets x_i - x_p.
fn mean_offset(line: &Line) -> f64 {
    let predator = line.config().predator_position.unwrap_or_default();
    let sum: f64 = line.sorted_states().map(|x| x - predator).sum();
    sum / line.config().num_agents as f64
}

/// Scales an offset or distance u to u / (1 + |u|).
pub(super) fn scaled(offset: f64) -> f64 {
    offset / (1.0 + offset.abs())
}
