//! Fuzz target for snapshots: a restored flock continues bitwise equally, and modified snapshots are rejected
//! or can be stepped.

#![no_main]

use arbitrary::{Result, Unstructured};
use flockesc_core::bindings::AtEnd;
use flockesc_core::{Batch, EpisodeConfig, FlockConfig, InitialState, Progress};
use flockesc_fuzz::{any_range, documents};
use libfuzzer_sys::fuzz_target;

/// Length of the header. Bytes 8 to 11 are the checksum of the body.
const HEAD: usize = 16;

fuzz_target!(|bytes: &[u8]| {
    let mut u = Unstructured::new(bytes);
    let Ok((scenario, options)) = documents(&mut u) else {
        return;
    };
    let _ = match scenario.dimension {
        2 => run::<2>(&scenario, &options, &mut u),
        _ => run::<3>(&scenario, &options, &mut u),
    };
});

fn run<const D: usize>(
    scenario: &FlockConfig,
    options: &EpisodeConfig,
    u: &mut Unstructured<'_>,
) -> Result<()> {
    let make = || {
        Batch::<D>::new(scenario.clone(), options.clone(), 1, Some(1))
            .expect("a flock with predators")
    };
    let (mut batch, mut other) = (make(), make());
    let start = InitialState::seeded(u.arbitrary()?);
    batch.reset(0, &start).expect("a good start");
    while !u.is_empty() {
        let state = batch.save(&[0]).expect("a slot");
        other.restore(&[0], &state).expect("a state");
        assert_eq!(other.save(&[0]).expect("a slot"), state);
        let ranges = (0..batch.rows())
            .map(|_| any_range(u))
            .collect::<Result<Vec<f64>>>()?;
        assert!(step(&mut batch, &ranges) == step(&mut other, &ranges));

        let mut body = state[HEAD..].to_vec();
        for _ in 0..u.int_in_range(1..=4)? {
            let place = u.choose_index(body.len())?;
            body[place] = u.arbitrary()?;
        }
        let mut made = [&state[..HEAD], &body].concat();
        made[8..12].copy_from_slice(&crc32fast::hash(&body).to_le_bytes());
        if other.restore(&[0], &made).is_ok() {
            step(&mut other, &ranges);
            step(&mut other, &ranges);
        }
    }
    Ok(())
}

/// Steps the batch, or restarts it after the end, and returns the bits of rewards and observations.
fn step<const D: usize>(batch: &mut Batch<D>, ranges: &[f64]) -> (Vec<u64>, Vec<u32>) {
    let (rows, length) = (batch.rows(), batch.row_length());
    let (mut rewards, mut observations) = (vec![0.0; rows], vec![0.0; rows * length]);
    batch
        .step_measured(
            (ranges, &[]),
            AtEnd::Restart,
            &mut rewards,
            &mut observations,
            &Progress::default(),
            |_| (),
        )
        .expect("a good step");
    (
        rewards.into_iter().map(f64::to_bits).collect(),
        observations.into_iter().map(f32::to_bits).collect(),
    )
}
