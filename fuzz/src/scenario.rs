//! Scenarios, options, ranges and places made of bytes: mostly ordinary ones, and the edges of what is taken.

use arbitrary::{Result, Unstructured};
use serde_json::{Value, json};

const LARGEST: f64 = 1e20;
const EDGES: [f64; 12] = [
    0.0, 5e-324, 1e-160, 1e-140, 1e-20, 1e-9, 0.5, 1.0, 3.0, 10.0, 1e12, LARGEST,
];

/// True once in `times`, and never where there are no more bytes: what they leave out is ordinary.
pub fn rarely(u: &mut Unstructured<'_>, times: u8) -> Result<bool> {
    Ok(!u.ratio(times - 1, times)?)
}

/// One of the edges, or any number from 0 to a hundred.
fn quantity(u: &mut Unstructured<'_>) -> Result<f64> {
    match rarely(u, 3)? {
        true => Ok(*u.choose(&EDGES)?),
        false => Ok(f64::from(u.arbitrary::<u16>()?) / 655.36),
    }
}

/// The same without what is too small to divide by.
fn positive(u: &mut Unstructured<'_>) -> Result<f64> {
    Ok(quantity(u)?.max(1e-20))
}

/// Any interaction range: a small one, an edge, or one beyond everything.
pub fn any_range(u: &mut Unstructured<'_>) -> Result<f64> {
    match rarely(u, 8)? {
        true => Ok(f64::MAX),
        false => quantity(u),
    }
}

/// `count` coordinates, many of them equal.
pub fn coordinates(u: &mut Unstructured<'_>, count: usize) -> Result<Vec<f64>> {
    let signed = |u: &mut Unstructured<'_>| {
        let size = quantity(u)?;
        Ok(if u.arbitrary()? { -size } else { size })
    };
    let on_lattice: bool = u.arbitrary()?;
    (0..count)
        .map(|_| match on_lattice {
            true => Ok(f64::from(u.int_in_range(-2..=2)?)),
            false => signed(u),
        })
        .collect()
}

/// One number, or one per agent.
fn per_agent(
    u: &mut Unstructured<'_>,
    agents: usize,
    number: fn(&mut Unstructured<'_>) -> Result<f64>,
) -> Result<Value> {
    match rarely(u, 4)? {
        true => Ok(json!(
            (0..agents)
                .map(|_| number(u))
                .collect::<Result<Vec<f64>>>()?
        )),
        false => Ok(json!(number(u)?)),
    }
}

fn predator(u: &mut Unstructured<'_>, dimension: usize) -> Result<Value> {
    let start =
        json!({"position": coordinates(u, dimension)?, "velocity": coordinates(u, dimension)?});
    let kinds = [
        "constant_velocity",
        "wandering",
        "learned",
        "pure_pursuit",
        "intercept",
        "encircle",
        "herd",
    ];
    let kind = *u.choose(&kinds)?;
    let own = match kind {
        "constant_velocity" => json!({}),
        "wandering" => json!({"angular_diffusion": quantity(u)?}),
        "learned" => json!({"max_acceleration": quantity(u)?, "max_speed": positive(u)?}),
        "pure_pursuit" => {
            let target = *u.choose(&["nearest", "centroid", "most_isolated", "assigned"])?;
            let confusion_rate = if target == "nearest" {
                quantity(u)?
            } else {
                0.0
            };
            json!({"target": target, "confusion_rate": confusion_rate, "sight": any_range(u)?})
        }
        "intercept" => json!({"navigation_constant": quantity(u)?}),
        "encircle" => json!({"radius": quantity(u)?, "closing_speed": quantity(u)?}),
        _ => json!({"distance": quantity(u)?, "partner": u.int_in_range(0..=3_usize)?}),
    };
    let is_fast: bool = u.arbitrary()?;
    let steering = match kind {
        "constant_velocity" | "wandering" | "learned" => json!({}),
        _ if is_fast => {
            json!({"max_turn_rate": quantity(u)?, "max_speed": LARGEST, "acceleration": quantity(u)?})
        }
        _ => json!({"max_turn_rate": quantity(u)?, "max_speed": null, "acceleration": 0.0}),
    };
    let mut fields = serde_json::Map::new();
    for part in [start, own, steering] {
        fields.extend(
            part.as_object()
                .into_iter()
                .flatten()
                .map(|(k, v)| (k.clone(), v.clone())),
        );
    }
    Ok(json!({kind: fields}))
}

/// The document of a small flock that has predators; most are good ones.
pub fn flock(u: &mut Unstructured<'_>) -> Result<Value> {
    let dimension = u.int_in_range(2..=3)?;
    let agents = match rarely(u, 8)? {
        true => u.int_in_range(60..=140)?,
        false => u.int_in_range(1..=12)?,
    };
    let positions = match u.int_in_range(0..=4)? {
        0 => json!({"disc": {"radius": positive(u)?}}),
        1 => json!({"ring": {"radius": positive(u)?, "width": 0.0}}),
        2 => json!({"gaussian": {"standard_deviation": quantity(u)?}}),
        3 => json!({"segment": {"start": coordinates(u, 2)?, "end": coordinates(u, 2)?}}),
        _ => json!({"square": {}}),
    };
    let motion = match u.int_in_range(0..=2)? {
        0 => json!({"inertial": {}}),
        1 => json!({"vicsek": {}}),
        _ => json!({"reynolds": {
            "separation_strength": quantity(u)?, "cohesion_strength": quantity(u)?, "separation_range": any_range(u)?,
        }}),
    };
    let rule = match dimension {
        2 => *u.choose(&["metric", "topological", "voronoi"])?,
        _ => *u.choose(&["metric", "topological"])?,
    };
    let capture_radius = if rarely(u, 3)? {
        Some(any_range(u)?)
    } else {
        None
    };
    let num_predators = u.int_in_range(1..=4)?;
    let predators = (0..num_predators)
        .map(|_| predator(u, dimension))
        .collect::<Result<Vec<Value>>>()?;
    let randomization = match rarely(u, 8)? {
        true => json!([{"uniform": {"field": "predator_range", "low": 0.0, "high": quantity(u)?}}]),
        false => json!([]),
    };
    Ok(json!({
        "num_agents": agents, "dimension": dimension, "num_steps": u.int_in_range(1..=12)?,
        "time_step": positive(u)?,
        "mass": per_agent(u, agents, positive)?,
        "speed": per_agent(u, agents, positive)?,
        "initial_side": positive(u)?,
        "initial_positions": positions, "initial_headings": {"random": {}},
        "initial_plane": rarely(u, 8)?,
        "predator_range": any_range(u)?,
        "repulsion_strength": per_agent(u, agents, quantity)?,
        "alignment_strength": per_agent(u, agents, quantity)?,
        "constant_speed": motion.get("vicsek").is_some() || u.ratio(2, 3)?,
        "motion": motion,
        "angular_noise": if rarely(u, 4)? { 1.0 } else { 0.0 },
        "sensing_noise": if rarely(u, 4)? { quantity(u)? } else { 0.0 },
        "sensing_delay": if rarely(u, 4)? { u.int_in_range(0..=3)? } else { 0 },
        "capture_radius": capture_radius,
        "predators": predators,
        "neighbor_rule": {rule: {}},
        "blind_angle": if rarely(u, 4)? { 2.0 } else { 0.0 },
        "mutual": rarely(u, 4)?, "frozen_graph": rarely(u, 8)?,
        "periodic_side": null, "randomization": randomization,
    }))
}

/// The document of what an environment makes of a flock; some do not fit together.
pub fn episode(u: &mut Unstructured<'_>) -> Result<Value> {
    let rewards = [
        "running_minimum",
        "distance",
        "individual_distance",
        "individual_distance_change",
        "individual_running_minimum",
        "neighborhood_distance_change",
        "difference",
        "terminal",
    ];
    let sensing = match u.int_in_range(0..=2)? {
        0 => json!(null),
        1 => json!("predator_range"),
        _ => json!(any_range(u)?),
    };
    Ok(json!({
        "view": u.choose(&["flock", "agent"])?, "objective": u.choose(&["mean", "minimum", "survival"])?,
        "reward": u.choose(&rewards)?, "max_range": positive(u)?, "predator_sensing_range": sensing,
        "steps_per_action": u.int_in_range(1..=3)?,
    }))
}
