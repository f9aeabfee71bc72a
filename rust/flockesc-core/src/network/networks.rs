//! Networks of one architecture on the rows of one observation, and what they remember between actions.

use super::architecture::{Architecture, Squash};
use super::forward::{LANES, Lanes, forward, squash};
use super::ranges::NormalizedRange;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};

/// Entry whose sign says on which side an agent has the predator, and the one that does so where that is 0.
const SIDES: [&str; 2] = ["predator_direction_left", "heard_velocity_left"];

/// Networks of one architecture: one that plays all episodes, or one per episode.
#[derive(Debug, Clone)]
pub struct Networks {
    shapes: Vec<(usize, usize)>,
    squash: Squash,
    memory: usize,
    ranges: NormalizedRange,
    /// Column of every input in a row, and whether it points to the left.
    inputs: Vec<(usize, bool)>,
    /// Columns of [`SIDES`], for rows that are reflected.
    sides: Option<[usize; 2]>,
    row_length: usize,
    /// Network after network.
    parameters: Vec<f64>,
    size: usize,
}

impl Networks {
    /// `count` networks on observations with these `entries`. `parameters` has [`Architecture::size`] numbers for each.
    ///
    /// # Errors
    /// [`Error::Config`] if the architecture is out of bounds; [`Error::Argument`] if `parameters` has another length or an
    /// entry that is not finite, or if an input is not observed.
    pub fn new(
        architecture: &Architecture,
        entries: &[Entry],
        ranges: NormalizedRange,
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
        let names = architecture.inputs.iter();
        let inputs = names.map(|name| {
            Ok((
                column(entries, name)?,
                architecture.mirror && name.ends_with("_left"),
            ))
        });
        let inputs = inputs.collect::<Result<_>>()?;
        let sides = match architecture.mirror {
            true => Some([column(entries, SIDES[0])?, column(entries, SIDES[1])?]),
            false => None,
        };
        Ok(Self {
            shapes: architecture.shapes(),
            squash: architecture.squash,
            memory: architecture.memory,
            ranges,
            inputs,
            sides,
            row_length: entries.len(),
            parameters: parameters.iter().copied().map(f64::from).collect(),
            size,
        })
    }

    /// The ranges in m that the first network sets for successive observations of one episode, each of as many rows.
    #[doc(hidden)]
    #[must_use]
    pub fn ranges(&self, observations: &[Vec<f32>]) -> Vec<Vec<f64>> {
        let lengths = observations.iter().map(Vec::len);
        let rows = lengths.min().unwrap_or_default() / self.row_length;
        let mut player = self.player(0, rows);
        let mut ranges = vec![vec![0.0; rows]; observations.len()];
        for (seen, ranges) in observations.iter().zip(&mut ranges) {
            player.act(seen, ranges);
        }
        ranges
    }

    /// Checks that there is one network for all of so many episodes, or one for each.
    pub(crate) fn check_count(&self, episodes: usize) -> Result<()> {
        let count = self.parameters.len() / self.size;
        if count == 1 || count == episodes {
            return Ok(());
        }
        let expected = format!("one network, or one for each of {episodes} seeds");
        Err(Error::argument("parameters", expected, count))
    }

    /// The network of an episode with so many rows, before its first action.
    pub(crate) fn player(&self, episode: usize, rows: usize) -> Player<'_> {
        let widths = self
            .shapes
            .iter()
            .map(|(inputs, outputs)| *inputs.max(outputs));
        let width = widths.max().unwrap_or_default();
        let first = episode * self.size % self.parameters.len();
        Player {
            networks: self,
            parameters: &self.parameters[first..first + self.size],
            memory: vec![[0.0; LANES]; rows.div_ceil(LANES) * self.memory],
            values: vec![[0.0; LANES]; width],
            scratch: vec![[0.0; LANES]; width],
        }
    }
}

/// The place of an entry in a row.
fn column(entries: &[Entry], name: &str) -> Result<usize> {
    let at = entries.iter().position(|entry| entry.name == name);
    at.ok_or_else(|| {
        let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        let given = format!("only {}", names.join(", "));
        Error::argument("observation", format!("an entry '{name}'"), given)
    })
}

/// One network in one episode.
#[derive(Debug)]
pub(crate) struct Player<'a> {
    networks: &'a Networks,
    parameters: &'a [f64],
    /// What every row remembers, [`LANES`] rows after the other.
    memory: Vec<Lanes>,
    values: Vec<Lanes>,
    scratch: Vec<Lanes>,
}

impl Player<'_> {
    /// Entries per observation row.
    pub(crate) fn row_length(&self) -> usize {
        self.networks.row_length
    }

    /// Writes the range in m of every observation row.
    pub(crate) fn act(&mut self, observations: &[f32], ranges: &mut [f64]) {
        let Networks {
            shapes,
            memory,
            row_length,
            ..
        } = self.networks;
        let blocks = observations
            .chunks(LANES * row_length)
            .zip(ranges.chunks_mut(LANES));
        for (block, (rows, ranges)) in blocks.enumerate() {
            let inputs = self.networks.inputs.len();
            self.read(rows);
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
                *range = self.networks.ranges.of(f64::from(action));
            }
        }
    }

    /// Reads the inputs of some rows, a lane for each.
    fn read(&mut self, rows: &[f32]) {
        let Networks {
            inputs,
            sides,
            row_length,
            ..
        } = self.networks;
        // Bits of the sign that entries to the left change.
        let mut turned = [0; LANES];
        if let Some([predator, heard]) = sides {
            for (row, turned) in rows.chunks_exact(*row_length).zip(&mut turned) {
                let side = if row[*predator] == 0.0 {
                    row[*heard]
                } else {
                    row[*predator]
                };
                *turned = u64::from(side < 0.0) << 63;
            }
        }
        for (value, (column, is_left)) in self.values.iter_mut().zip(inputs) {
            let turned = if *is_left { turned } else { [0; LANES] };
            let entries = rows.chunks_exact(*row_length).map(|row| row[*column]);
            for ((value, entry), turned) in value.iter_mut().zip(entries).zip(turned) {
                *value = f64::from_bits(f64::from(entry).to_bits() ^ turned);
            }
        }
    }
}
