use serde_json::{Value, json};

use super::*;
use crate::base::error::Error;
use crate::predator::Learned;

/// Returns the document of the paper's flock.
pub(in crate::flock) fn paper() -> Value {
    serde_json::to_value(FlockConfig::default()).expect("a document")
}

fn refused(pointer: &str, value: Value) -> String {
    let mut document = paper();
    let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
    let parent = document.pointer_mut(parent).expect("a parent");
    match parent {
        Value::Object(fields) => drop(fields.insert(key.to_owned(), value)),
        Value::Array(entries) => entries[key.parse::<usize>().expect("an index")] = value,
        _ => panic!("no container"),
    }
    match FlockConfig::from_json(&document.to_string()) {
        Err(Error::Input { field, .. }) => field,
        other => panic!("{pointer}: {other:?}"),
    }
}

#[test]
fn the_default_is_accepted() {
    assert_eq!(FlockConfig::default().check(), Ok(()));
    let parsed = FlockConfig::from_json(&paper().to_string());
    assert_eq!(parsed, Ok(FlockConfig::default()));
}

#[test]
fn learned_predators_are_those_that_take_actions() {
    let mut flock = FlockConfig::default();
    assert_eq!(flock.num_learned(), 0);
    flock.predators.push(PredatorConfig::Learned(Learned {
        position: vec![0.0, 0.0],
        velocity: vec![1.0, 0.0],
        max_acceleration: 20.0,
        max_speed: 15.0,
    }));
    assert_eq!((flock.predators.len(), flock.num_learned()), (2, 1));
}

#[test]
fn errors_name_the_field() {
    let predator = json!({"pure_pursuit": {"position": [0.0, 0.0], "velocity": [1.0, 0.0],
                                           "max_turn_rate": -1.0, "max_speed": null,
                                           "acceleration": 0.0, "target": "nearest", "confusion_rate": 0.0,
                                           "sight": 30.0}});
    for (pointer, value, field) in [
        ("/num_agents", json!(0), "num_agents"),
        ("/num_agents", json!(-1), "num_agents"),
        ("/num_agents", json!(10_000_001), "num_agents"),
        ("/dimension", json!(4), "dimension"),
        ("/time_step", json!(0.0), "time_step"),
        ("/mass", json!("heavy"), "mass"),
        ("/mass", json!([0.1, 0.2]), "mass"),
        ("/speed", json!(vec![0.0; 300]), "speed[0]"),
        ("/alignment_strength", json!(-1.0), "alignment_strength"),
        (
            "/motion",
            json!({"vicsek": {"noise": 1.0}}),
            "motion.vicsek.noise",
        ),
        (
            "/motion",
            json!({"reynolds": {"separation_strength": 1.0, "cohesion_strength": 1.0, "separation_range": -1.0}}),
            "motion.reynolds.separation_range",
        ),
        ("/angular_noise", json!(6.3), "angular_noise"),
        ("/sensing_noise", json!(-0.1), "sensing_noise"),
        ("/sensing_delay", json!(1.5), "sensing_delay"),
        ("/predator_range", json!(-1.0), "predator_range"),
        ("/capture_radius", json!(-1.0), "capture_radius"),
        ("/capture_radius", json!("near"), "capture_radius"),
        ("/initial_positions", json!("torus"), "initial_positions"),
        (
            "/initial_positions",
            json!({"ring": {"radius": 5.0, "width": 11.0}}),
            "initial_positions.ring.width",
        ),
        (
            "/initial_headings",
            json!({"aligned": {"direction": [0.0, 0.0], "max_angle": 0.0}}),
            "initial_headings.aligned.direction",
        ),
        ("/wings", json!(2), "wings"),
        (
            "/neighbor_rule",
            json!({"metric": {"k": 3}}),
            "neighbor_rule.metric.k",
        ),
        ("/blind_angle", json!(6.3), "blind_angle"),
        ("/mutual", json!(1), "mutual"),
        ("/periodic_side", json!(0.0), "periodic_side"),
        ("/periodic_side", json!(100.0), "periodic_side"),
        (
            "/predators/0",
            predator,
            "predators[0].pure_pursuit.max_turn_rate",
        ),
        (
            "/predators/0",
            json!({"learned": {"position": [0.0, 0.0], "velocity": [1.0, 0.0],
                               "max_acceleration": 20.0, "max_speed": 0.0}}),
            "predators[0].learned.max_speed",
        ),
        (
            "/predators/0/constant_velocity/position",
            json!([1.0, 2.0, 3.0]),
            "predators[0].constant_velocity.position",
        ),
        (
            "/predators/0/constant_velocity/velocity/1",
            json!(null),
            "predators[0].constant_velocity.velocity[1]",
        ),
    ] {
        assert_eq!(refused(pointer, value), field);
    }
}

#[test]
fn missing_fields_have_their_default() {
    assert_eq!(FlockConfig::from_json("{}"), Ok(FlockConfig::default()));
}

#[test]
fn invalid_documents_are_rejected() {
    for text in ["", "{", "[]", "3", "null", "\u{0}"] {
        assert!(FlockConfig::from_json(text).is_err(), "{text:?}");
    }
}
