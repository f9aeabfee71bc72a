//! Batches of several scenarios.

use super::*;
use crate::predator::Learned;

#[test]
fn slots_of_several_scenarios_equal_batches_of_one() {
    let (config, scenarios) = (documents().1, scenarios());
    for threads in [1, 3] {
        let mut many = Batch::<2>::with_scenarios(&scenarios, config.clone(), Some(threads))
            .expect("scenarios of one shape");
        let mut alone: Vec<_> = scenarios
            .iter()
            .map(|scenario| {
                let scenario = scenario.as_ref().clone();
                Batch::<2>::new(scenario, config.clone(), 1, Some(1)).expect("a good scenario")
            })
            .collect();
        for (slot, alone) in alone.iter_mut().enumerate() {
            let start = InitialState::seeded(slot as u64);
            many.reset(slot, &start).expect("a slot");
            alone.reset(0, &start).expect("a slot");
        }
        assert_eq!(many.work(), alone.iter().map(Batch::work).sum::<usize>());
        for _ in 0..12 {
            let together = restarting(&mut many);
            for (slot, alone) in alone.iter_mut().enumerate() {
                let (rewards, observations) = restarting(alone);
                let width = observations.len();
                assert_eq!(rewards, together.0[slot * AGENTS..(slot + 1) * AGENTS]);
                assert_eq!(observations, together.1[slot * width..(slot + 1) * width]);
                let state = alone.save(&[0]);
                assert_eq!(many.save(&[slot]), state);
            }
        }
    }
}

/// Steps a batch whose slots start their next episode at the end of one.
fn restarting(batch: &mut Batch<2>) -> (Vec<f64>, Vec<f32>) {
    let rows = batch.num_flocks() * AGENTS;
    let (mut rewards, mut seen) = (vec![0.0; rows], vec![0.0; rows * batch.row_length()]);
    let (ranges, progress) = (vec![4.0; rows], Progress::default());
    let action = (&ranges[..], &[][..]);
    batch
        .step_measured(
            action,
            AtEnd::Restart,
            &mut rewards,
            &mut seen,
            &progress,
            |_| (),
        )
        .expect("good ranges");
    (rewards, seen)
}

#[test]
fn scenarios_of_other_shapes_are_rejected() {
    let [first, ..] = scenarios();
    let learned = PredatorConfig::Learned(Learned {
        position: vec![0.0, 0.0],
        velocity: vec![1.0, 0.0],
        max_acceleration: 1.0,
        max_speed: 10.0,
    });
    let in_space = ConstantVelocity {
        position: vec![-5.0; 3],
        velocity: vec![10.0; 3],
    };
    let unlike = [
        (
            "num_agents",
            FlockConfig {
                num_agents: AGENTS + 1,
                ..first.as_ref().clone()
            },
        ),
        (
            "predators",
            FlockConfig {
                predators: vec![learned],
                ..first.as_ref().clone()
            },
        ),
        (
            "predators",
            FlockConfig {
                predators: vec![],
                ..first.as_ref().clone()
            },
        ),
        (
            "dimension",
            FlockConfig {
                dimension: 3,
                predators: vec![PredatorConfig::ConstantVelocity(in_space)],
                ..first.as_ref().clone()
            },
        ),
    ];
    for (name, scenario) in unlike {
        let scenarios = [first.clone(), first.clone(), Arc::new(scenario)];
        let error = Batch::<2>::with_scenarios(&scenarios, documents().1, Some(1))
            .expect_err("another shape")
            .to_string();
        let field = format!("scenario[2].{name}: ");
        assert!(error.starts_with(&field), "{error}");
    }
    assert!(Batch::<2>::with_scenarios(&[], documents().1, Some(1)).is_err());
}
