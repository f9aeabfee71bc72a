//! Generation of valid scenarios and options from bytes.

use arbitrary::{Error, Result, Unstructured};
use flockesc_core::{EpisodeConfig, FlockConfig};
use serde::Deserialize;

use crate::maker::{Context, Maker};

/// Generates a valid scenario with predators and valid options of an episode.
pub fn documents(u: &mut Unstructured<'_>) -> Result<(FlockConfig, EpisodeConfig)> {
    let mut context = Context::default();
    let refused = |_| Error::IncorrectFormat;
    let scenario = FlockConfig::deserialize(Maker::new(u, &mut context)).map_err(refused)?;
    let options = EpisodeConfig::deserialize(Maker::new(u, &mut context)).map_err(refused)?;
    scenario.check().map_err(|_| Error::IncorrectFormat)?;
    options.check().map_err(|_| Error::IncorrectFormat)?;
    Ok((scenario, options))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Every part is generated, and many of the scenarios are accepted.
    #[test]
    fn generates_every_part() {
        let mut word = 1_u64;
        let mut byte = || {
            word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (word >> 56) as u8
        };
        let (mut accepted, mut text) = (0, BTreeSet::new());
        for _ in 0..4000 {
            let bytes: Vec<u8> = (0..2000).map(|_| byte()).collect();
            if let Ok((scenario, options)) = documents(&mut Unstructured::new(&bytes)) {
                accepted += 1;
                let options = serde_json::to_string(&options).expect("a document");
                for document in [scenario.to_json(), options] {
                    text.extend(document.split('"').map(str::to_owned));
                }
            }
        }
        assert!(accepted > 1000, "{accepted}");
        for (family, kinds) in flockesc_core::kinds() {
            let is_of_line = ["escape_forces", "line_rewards"].contains(family);
            for kind in kinds.iter().filter(|_| !is_of_line) {
                assert!(text.contains(*kind), "{family}: {kind}");
            }
        }
    }
}
