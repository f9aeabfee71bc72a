//! `Networks`: networks of one architecture, and their memory during an episode.

use super::architecture::{Architecture, Squash};
use super::forward::{LANES, Lanes, forward, squash};
use super::ranges::NetworkRanges;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};

/// Entries whose sign determines whether a row is reflected. The second entry counts if the first
/// is 0.
const MIRROR_ENTRIES: [&str; 2] = ["predator_direction_left", "heard_velocity_left"];

/// Networks of one architecture: one network for all episodes, or one per episode.
#[derive(Debug, Clone)]
pub struct Networks {
    shapes: Vec<(usize, usize)>,
    squash: Squash,
    memory: usize,
    ranges: NetworkRanges,
    inputs: Vec<Input>,
    /// The inputs of every candidate range.
    candidates: Vec<Vec<Input>>,
    /// Columns of [`MIRROR_ENTRIES`], if rows are reflected.
    mirror_columns: Option<[usize; 2]>,
    row_length: usize,
    /// Parameters of all networks, network after network.
    parameters: Vec<f64>,
    /// Number of parameters per network.
    size: usize,
}

/// An input of a network.
#[derive(Debug, Clone, Copy)]
enum Input {
    /// The column of an observation row, and whether reflection changes its sign.
    Column(usize, bool),
    Constant(f64),
}

impl Networks {
    /// Creates `count` networks. `entries` are the entries of an observation row. `parameters` has
    /// [`Architecture::size`] numbers per network.
    ///
    /// # Errors
    /// [`Error::Config`] if a field of the architecture is out of bounds; [`Error::Argument`] if
    /// `parameters` has the wrong length or an entry that is not finite, or if an input is not one
    /// of `entries`.
    pub fn new(
        architecture: &Architecture,
        entries: &[Entry],
        ranges: NetworkRanges,
        parameters: &[f32],
        count: usize,
    ) -> Result<Self> {
        architecture.check()?;
        let size = architecture.size();
        if parameters.len() != size.saturating_mul(count) {
            let expected = format!("{size} numbers per network");
            let given = parameters.len() / count.max(1);
            return Err(Error::argument("parameters", expected, given));
        }
        if let Some(at) = parameters.iter().position(|number| !number.is_finite()) {
            let field = format!("parameters[{}, {}]", at / size, at % size);
            return Err(Error::argument(field, "a finite number", parameters[at]));
        }
        let input = |name: &str| {
            let is_left = architecture.mirror && name.ends_with("_left");
            Ok(Input::Column(column(entries, name)?, is_left))
        };
        let names = architecture.inputs.iter();
        let inputs = names.map(|name| input(name)).collect::<Result<_>>()?;
        let candidates = match &ranges {
            NetworkRanges::Candidates(ranges) if architecture.is_scorer() && !ranges.is_empty() => {
                let largest = ranges.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
                let names = &architecture.candidate_inputs;
                let inputs_of = |(k, range): (usize, &f64)| {
                    let inputs = names.iter().map(|name| match name.as_str() {
                        "range" => Ok(Input::Constant(range / largest)),
                        name => input(&format!("profile_{k}_{name}")),
                    });
                    inputs.collect::<Result<_>>()
                };
                ranges
                    .iter()
                    .enumerate()
                    .map(inputs_of)
                    .collect::<Result<_>>()?
            }
            NetworkRanges::Normalized(_) if !architecture.is_scorer() => Vec::new(),
            _ => {
                let expected = "candidate ranges for a network that scores them, and only for it";
                return Err(Error::argument("profile_ranges", expected, "others"));
            }
        };
        let mirror_columns = match architecture.mirror {
            true => Some([
                column(entries, MIRROR_ENTRIES[0])?,
                column(entries, MIRROR_ENTRIES[1])?,
            ]),
            false => None,
        };
        Ok(Self {
            shapes: architecture.shapes(),
            squash: architecture.squash,
            memory: architecture.memory,
            ranges,
            inputs,
            candidates,
            mirror_columns,
            row_length: entries.len(),
            parameters: parameters.iter().copied().map(f64::from).collect(),
            size,
        })
    }

    /// Returns the ranges in m that the first network sets for successive observations of one
    /// episode. All observations have the same number of rows.
    #[doc(hidden)]
    #[must_use]
    pub fn ranges(&self, observations: &[Vec<f32>]) -> Vec<Vec<f64>> {
        let lengths = observations.iter().map(Vec::len);
        let rows = lengths.min().unwrap_or_default() / self.row_length;
        let mut network = self.for_episode(0, rows);
        let mut ranges = vec![vec![0.0; rows]; observations.len()];
        for (rows, ranges) in observations.iter().zip(&mut ranges) {
            network.act(rows, ranges);
        }
        ranges
    }

    /// Checks that there is one network, or one per episode.
    pub(crate) fn check_count(&self, episodes: usize) -> Result<()> {
        let count = self.parameters.len() / self.size;
        if count == 1 || count == episodes {
            return Ok(());
        }
        let expected = format!("one network, or one for each of {episodes} seeds");
        Err(Error::argument("parameters", expected, count))
    }

    /// Returns the network of an episode, before its first action. `rows` is the number of
    /// observation rows.
    pub(crate) fn for_episode(&self, episode: usize, rows: usize) -> EpisodeNetwork<'_> {
        let widths = self
            .shapes
            .iter()
            .map(|(inputs, outputs)| *inputs.max(outputs));
        let width = widths.max().unwrap_or_default();
        let first = episode * self.size % self.parameters.len();
        EpisodeNetwork {
            networks: self,
            parameters: &self.parameters[first..first + self.size],
            memory: vec![[0.0; LANES]; rows.div_ceil(LANES) * self.memory],
            values: vec![[0.0; LANES]; width],
            scratch: vec![[0.0; LANES]; width],
            own: vec![[0.0; LANES]; self.inputs.len()],
        }
    }
}

/// Returns the column of the entry `name` in a row.
fn column(entries: &[Entry], name: &str) -> Result<usize> {
    let at = entries.iter().position(|entry| entry.name == name);
    at.ok_or_else(|| {
        let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        let given = format!("only {}", names.join(", "));
        Error::argument("observation", format!("an entry '{name}'"), given)
    })
}

/// One network and its memory in one episode.
#[derive(Debug)]
pub(crate) struct EpisodeNetwork<'a> {
    networks: &'a Networks,
    parameters: &'a [f64],
    /// Memory of all rows, in blocks of [`LANES`] rows.
    memory: Vec<Lanes>,
    values: Vec<Lanes>,
    scratch: Vec<Lanes>,
    /// Inputs that are the same for all candidates.
    own: Vec<Lanes>,
}

impl EpisodeNetwork<'_> {
    /// Returns the number of entries of an observation row.
    pub(crate) fn row_length(&self) -> usize {
        self.networks.row_length
    }

    /// Writes the range in m of every observation row, and updates the memory.
    pub(crate) fn act(&mut self, observations: &[f32], ranges: &mut [f64]) {
        let Networks {
            shapes,
            memory,
            ranges: map,
            row_length,
            ..
        } = self.networks;
        let blocks = observations
            .chunks(LANES * row_length)
            .zip(ranges.chunks_mut(LANES));
        for (block, (rows, ranges)) in blocks.enumerate() {
            let inputs = self.networks.inputs.len();
            let sign_flips = self.networks.sign_flips(rows);
            self.networks
                .read(&self.networks.inputs, rows, &sign_flips, &mut self.values);
            let map = match map {
                NetworkRanges::Normalized(map) => map,
                NetworkRanges::Candidates(candidates) => {
                    self.choose(candidates, rows, &sign_flips, ranges);
                    continue;
                }
            };
            let remembered = block * memory..(block + 1) * memory;
            self.values[inputs..inputs + memory].copy_from_slice(&self.memory[remembered.clone()]);
            forward(shapes, self.parameters, &mut self.values, &mut self.scratch);
            let (action, rest) = self.values.split_at_mut(1);
            squash(&mut rest[..*memory]);
            self.memory[remembered].copy_from_slice(&rest[..*memory]);
            if self.networks.squash == Squash::Tanh {
                squash(action);
            }
            for (range, action) in ranges.iter_mut().zip(action[0]) {
                // Actions are float32 in every interface.
                let action = action.clamp(-1.0, 1.0) as f32;
                *range = map.of(f64::from(action));
            }
        }
    }

    /// Writes the candidate range with the highest score for each of at most [`LANES`] rows.
    fn choose(
        &mut self,
        candidates: &[f64],
        rows: &[f32],
        sign_flips: &[u64; LANES],
        ranges: &mut [f64],
    ) {
        let networks = self.networks;
        let inputs = networks.inputs.len();
        self.own.copy_from_slice(&self.values[..inputs]);
        let mut highest = [f64::NEG_INFINITY; LANES];
        for (candidate, columns) in candidates.iter().zip(&networks.candidates) {
            self.values[..inputs].copy_from_slice(&self.own);
            networks.read(columns, rows, sign_flips, &mut self.values[inputs..]);
            let shapes = &networks.shapes;
            forward(shapes, self.parameters, &mut self.values, &mut self.scratch);
            let scores = self.values[0];
            for ((range, score), highest) in ranges.iter_mut().zip(scores).zip(&mut highest) {
                if score > *highest {
                    (*range, *highest) = (*candidate, score);
                }
            }
        }
    }
}

impl Networks {
    /// Returns the bit masks that negate the entries to the left, for at most [`LANES`] rows.
    fn sign_flips(&self, rows: &[f32]) -> [u64; LANES] {
        let mut sign_flips = [0; LANES];
        if let Some([predator, heard]) = self.mirror_columns {
            for (row, sign_flip) in rows.chunks_exact(self.row_length).zip(&mut sign_flips) {
                let side = if row[predator] == 0.0 {
                    row[heard]
                } else {
                    row[predator]
                };
                *sign_flip = u64::from(side < 0.0) << 63;
            }
        }
        sign_flips
    }

    /// Copies inputs of at most [`LANES`] rows to `values`, one lane per row.
    fn read(
        &self,
        inputs: &[Input],
        rows: &[f32],
        sign_flips: &[u64; LANES],
        values: &mut [Lanes],
    ) {
        for (value, input) in values.iter_mut().zip(inputs) {
            match *input {
                Input::Constant(number) => *value = [number; LANES],
                Input::Column(column, is_left) => {
                    let sign_flips = if is_left { *sign_flips } else { [0; LANES] };
                    let entries = rows.chunks_exact(self.row_length).map(|row| row[column]);
                    for ((value, entry), sign_flip) in value.iter_mut().zip(entries).zip(sign_flips)
                    {
                        *value = f64::from_bits(f64::from(entry).to_bits() ^ sign_flip);
                    }
                }
            }
        }
    }
}
