//! `Networks`: networks of one architecture, and their memory during an episode.

use super::actions::NormalizedRange;
use super::architecture::{Architecture, Head, Squash};
use super::forward::{LANES, Lanes, forward, squash, work};
use crate::base::check::require;
use crate::base::error::{Error, Result};
use crate::parallel::Progress;

/// Entries whose sign determines whether a row is reflected. The second entry counts if the first
/// is 0.
const MIRROR_ENTRIES: [&str; 2] = ["predator_direction_left", "heard_velocity_left"];

/// The ranges that networks can set.
#[derive(Debug, Clone)]
pub enum NetworkRanges {
    /// Those of actions in [-1, 1]; for [`Head::Value`].
    Normalized(NormalizedRange),
    /// The ranges in m that a network chooses from; for [`Head::Argmax`] and [`Head::Candidates`].
    Choices(Vec<f64>),
}

impl NetworkRanges {
    /// Returns the range in m of an output of [`Networks::outputs`].
    pub fn of(&self, output: f64) -> f64 {
        match self {
            Self::Normalized(map) => map.of(output),
            Self::Choices(choices) => choices[output as usize],
        }
    }
}

/// Networks of one architecture: one network for all episodes, or one per episode.
#[derive(Debug, Clone)]
pub struct Networks {
    architecture: Architecture,
    shapes: Vec<(usize, usize)>,
    ranges: NetworkRanges,
    inputs: Vec<Input>,
    /// The inputs of every candidate of [`Head::Candidates`].
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
    /// Creates `count` networks. `entries` are the names of the entries of an observation row. `parameters` has
    /// [`Architecture::size`] numbers per network.
    ///
    /// # Errors
    /// [`Error::Input`] if a field of the architecture is out of bounds; if
    /// `parameters` has the wrong length or an entry that is not finite, if an input is not one of `entries`,
    /// or if `ranges` are not those of the head.
    pub fn new(
        architecture: &Architecture,
        entries: &[String],
        ranges: NetworkRanges,
        parameters: &[f32],
        count: usize,
    ) -> Result<Self> {
        architecture.check()?;
        let size = architecture.size();
        let has_all = parameters.len() == size.saturating_mul(count);
        let (expected, given) = (
            format!("{size} numbers per network"),
            parameters.len() / count.max(1),
        );
        require(has_all, "parameters", &expected, given)?;
        if let Some(at) = parameters.iter().position(|number| !number.is_finite()) {
            let field = format!("parameters[{}, {}]", at / size, at % size);
            return Err(Error::input(field, "a finite number", parameters[at]));
        }
        let input = |name: &str| {
            let is_left = architecture.mirror && name.ends_with("_left");
            Ok(Input::Column(column(entries, name)?, is_left))
        };
        let choices: &[f64] = match &ranges {
            NetworkRanges::Normalized(_) => &[],
            NetworkRanges::Choices(choices) => choices,
        };
        let is_right = match architecture.head() {
            Head::Value => choices.is_empty(),
            Head::Argmax => choices.len() == architecture.ranges.len(),
            Head::Candidates => !choices.is_empty(),
        };
        let expected = "candidate ranges for a network that chooses, and only for it";
        require(is_right, "profile_ranges", expected, choices.len())?;
        let largest = choices.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let candidate = |(k, range): (usize, &f64)| {
            let names = architecture.candidate_inputs.iter();
            let inputs = names.map(|name| match name.as_str() {
                "range" => Ok(Input::Constant(range / largest)),
                name => input(&format!("profile_{k}_{name}")),
            });
            inputs.collect::<Result<Vec<_>>>()
        };
        let candidates = choices.iter().enumerate().map(candidate);
        let candidates = candidates.collect::<Result<_>>()?;
        let mut mirror_columns = None;
        if architecture.mirror {
            let [predator, heard] = MIRROR_ENTRIES;
            mirror_columns = Some([column(entries, predator)?, column(entries, heard)?]);
        }
        let inputs = architecture.inputs.iter().map(|name| input(name));
        Ok(Self {
            shapes: architecture.shapes(),
            ranges,
            inputs: inputs.collect::<Result<_>>()?,
            candidates,
            mirror_columns,
            row_length: entries.len(),
            parameters: parameters.iter().copied().map(f64::from).collect(),
            size,
            architecture: architecture.clone(),
        })
    }

    /// Returns the output of the first network for every observation row: the action of [`Head::Value`], or the
    /// index of the range that it chooses. `memory` has [`Architecture::memory`] numbers per row and is updated.
    ///
    /// # Errors
    /// [`Error::Input`] if an array has the wrong length; [`Error::Interrupted`] if `progress` was cancelled.
    pub fn outputs(
        &self,
        observations: &[f32],
        memory: &mut Vec<f64>,
        progress: &Progress,
    ) -> Result<Vec<f64>> {
        let rows = observations.len() / self.row_length;
        let lengths = (rows * self.row_length, rows * self.architecture.memory);
        if (observations.len(), memory.len()) != lengths {
            let expected = format!("rows of {} entries", self.row_length);
            return Err(Error::input("observations", expected, "others"));
        }
        let mut network = self.for_episode(0, rows);
        network.memory.copy_from_slice(memory);
        let mut outputs = vec![0.0; rows];
        network.output(observations, &mut outputs, progress)?;
        *memory = network.memory;
        Ok(outputs)
    }

    /// Returns the work of the outputs of `rows` rows, as a number of visited agents that take as long.
    pub fn work(&self, rows: usize) -> usize {
        let passes = self.candidates.len().max(1);
        work(rows, self.size.saturating_mul(passes))
    }

    /// Checks that there is one network, or one per episode.
    pub(crate) fn check_count(&self, episodes: usize) -> Result<()> {
        let count = self.parameters.len() / self.size;
        let expected = format!("one network, or one for each of {episodes} seeds");
        require(
            count == 1 || count == episodes,
            "parameters",
            &expected,
            count,
        )
    }

    /// Returns the network of an episode, before its first action. `rows` is the number of
    /// observation rows.
    pub(crate) fn for_episode(&self, episode: usize, rows: usize) -> EpisodeNetwork<'_> {
        let widths = self.shapes.iter().map(|layer| layer.0.max(layer.1));
        let lanes = vec![[0.0; LANES]; widths.max().unwrap_or_default()];
        let first = episode * self.size % self.parameters.len();
        EpisodeNetwork {
            networks: self,
            parameters: &self.parameters[first..first + self.size],
            memory: vec![0.0; rows * self.architecture.memory],
            values: lanes.clone(),
            scratch: lanes,
            scores: Vec::new(),
        }
    }

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
                    let mut entries = [0.0; LANES];
                    for (entry, row) in entries.iter_mut().zip(rows.chunks_exact(self.row_length)) {
                        *entry = row[column];
                    }
                    for lane in 0..LANES {
                        let sign_flip = if is_left { sign_flips[lane] } else { 0 };
                        let entry = f64::from(entries[lane]);
                        value[lane] = f64::from_bits(entry.to_bits() ^ sign_flip);
                    }
                }
            }
        }
    }
}

/// Returns the column of the entry `name` in a row.
fn column(entries: &[String], name: &str) -> Result<usize> {
    let at = entries.iter().position(|entry| entry == name);
    at.ok_or_else(|| {
        let given = format!("only {}", entries.join(", "));
        Error::input("observation", format!("an entry '{name}'"), given)
    })
}

/// One network and its memory in one episode.
#[derive(Debug)]
pub(crate) struct EpisodeNetwork<'a> {
    networks: &'a Networks,
    parameters: &'a [f64],
    /// Memory of all rows, row after row.
    memory: Vec<f64>,
    values: Vec<Lanes>,
    scratch: Vec<Lanes>,
    /// Scores of the candidates.
    scores: Vec<Lanes>,
}

impl EpisodeNetwork<'_> {
    /// Returns the number of entries of an observation row.
    pub(crate) fn row_length(&self) -> usize {
        self.networks.row_length
    }

    /// Writes the range in m of every observation row, and updates the memory.
    pub(crate) fn act(
        &mut self,
        observations: &[f32],
        ranges: &mut [f64],
        progress: &Progress,
    ) -> Result<()> {
        self.output(observations, ranges, progress)?;
        for range in ranges {
            *range = self.networks.ranges.of(*range);
        }
        Ok(())
    }

    /// Writes the output of every observation row, and updates the memory; see [`Networks::outputs`].
    fn output(
        &mut self,
        observations: &[f32],
        outputs: &mut [f64],
        progress: &Progress,
    ) -> Result<()> {
        let networks = self.networks;
        let blocks = observations.chunks(LANES * networks.row_length);
        for (block, (rows, outputs)) in blocks.zip(outputs.chunks_mut(LANES)).enumerate() {
            progress.check()?;
            let sign_flips = networks.sign_flips(rows);
            networks.read(&networks.inputs, rows, &sign_flips, &mut self.values);
            match networks.architecture.head() {
                Head::Value => self.value(block, outputs),
                Head::Argmax => {
                    self.forward();
                    argmax(&self.values[..networks.architecture.ranges.len()], outputs);
                }
                Head::Candidates => {
                    self.score(rows, &sign_flips);
                    argmax(&self.scores, outputs);
                }
            }
        }
        Ok(())
    }

    fn forward(&mut self) {
        let (shapes, activation) = (&self.networks.shapes, self.networks.architecture.activation);
        forward(
            shapes,
            activation,
            self.parameters,
            &mut self.values,
            &mut self.scratch,
        );
    }

    /// Writes the actions of a block of rows, and updates their memory.
    fn value(&mut self, block: usize, actions: &mut [f64]) {
        let Architecture {
            inputs,
            memory,
            squash: bound,
            ..
        } = &self.networks.architecture;
        let remembered = block * LANES * memory..(block * LANES + actions.len()) * memory;
        let rows = self.memory[remembered.clone()].chunks_exact((*memory).max(1));
        for (lane, row) in rows.enumerate() {
            for (value, number) in self.values[inputs.len()..].iter_mut().zip(row) {
                value[lane] = *number;
            }
        }
        self.forward();
        squash(&mut self.values[1..=*memory]);
        let rows = self.memory[remembered].chunks_exact_mut((*memory).max(1));
        for (lane, row) in rows.enumerate() {
            for (value, number) in self.values[1..].iter().zip(row) {
                *number = value[lane];
            }
        }
        if *bound == Squash::Tanh {
            squash(&mut self.values[..1]);
        }
        for (action, value) in actions.iter_mut().zip(self.values[0]) {
            // Actions are float32 in every interface.
            *action = f64::from(value.clamp(-1.0, 1.0) as f32);
        }
    }

    /// Computes the scores of all candidates for at most [`LANES`] rows.
    fn score(&mut self, rows: &[f32], sign_flips: &[u64; LANES]) {
        let networks = self.networks;
        self.scores.clear();
        for candidate in &networks.candidates {
            let (own, rest) = self.values.split_at_mut(networks.inputs.len());
            networks.read(&networks.inputs, rows, sign_flips, own);
            networks.read(candidate, rows, sign_flips, rest);
            self.forward();
            self.scores.push(self.values[0]);
        }
    }
}

/// Writes the index of the highest score of every row, the first among equals.
fn argmax(scores: &[Lanes], indices: &mut [f64]) {
    let mut highest = [f64::NEG_INFINITY; LANES];
    indices.fill(0.0);
    for (k, scores) in scores.iter().enumerate() {
        for ((index, score), highest) in indices.iter_mut().zip(scores).zip(&mut highest) {
            if score > highest {
                (*index, *highest) = (k as f64, *score);
            }
        }
    }
}
