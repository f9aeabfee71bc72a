//! `ActionOptions`: the maps between actions and interaction ranges.

use serde::Deserialize;

use crate::base::check::{MAX_STEPS, clipped, not_negative, positive, within, within_bounds};
use crate::base::document::parse;
use crate::base::error::{Error, Result};

/// Number of ranges in the default grid of [`ActionMode::Discrete`].
const GRID_SIZE: usize = 21;

/// How an action sets the interaction range (docs/model.md, "Actions"). Every field has a default in documents.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ActionOptions {
    /// What an action is.
    pub action_mode: ActionMode,
    /// Smallest range in m, at least 0.
    pub min_range: f64,
    /// Largest range in m, above `min_range`.
    pub max_range: f64,
    /// Ranges in m of [`ActionMode::Discrete`]; `None`: 21 equally spaced ones.
    pub range_grid: Option<Vec<f64>>,
    /// Number of model steps per action, at least 1.
    pub steps_per_action: usize,
}

/// What an action is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActionMode {
    /// A number in [-1, 1].
    Normalized,
    /// The range in m.
    Range,
    /// An index into the grid.
    Discrete,
}

impl Default for ActionOptions {
    /// Returns the options of an environment of a flock.
    fn default() -> Self {
        Self {
            action_mode: ActionMode::Normalized,
            min_range: 0.0,
            max_range: 40.0,
            range_grid: None,
            steps_per_action: 4,
        }
    }
}

impl ActionOptions {
    /// Names of the fields.
    pub const FIELDS: [&str; 5] = [
        "action_mode",
        "min_range",
        "max_range",
        "range_grid",
        "steps_per_action",
    ];

    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let options: Self = parse(document)?;
        options.check()?;
        Ok(options)
    }

    fn check(&self) -> Result<()> {
        let (low, high) = (self.min_range, self.max_range);
        not_negative("min_range", low)?;
        positive("max_range", high)?;
        if high <= low {
            let expected = format!("a number above min_range = {low:?}");
            return Err(Error::input("max_range", expected, high));
        }
        if self.action_mode == ActionMode::Range && high > f64::from(f32::MAX) {
            let expected = format!("at most {:e}, the largest float32", f32::MAX);
            return Err(Error::input("max_range", expected, high));
        }
        within("steps_per_action", self.steps_per_action, 1, MAX_STEPS)?;
        if let Some(grid) = &self.range_grid
            && (grid.is_empty() || !grid.iter().all(|range| (low..=high).contains(range)))
        {
            let expected = format!("ranges from {low:?} to {high:?}");
            return Err(Error::input("range_grid", expected, format!("{grid:?}")));
        }
        Ok(())
    }
}

/// The maps between the actions of checked options and ranges.
#[derive(Debug, Clone)]
pub struct RangeMap {
    options: ActionOptions,
    /// Ranges in m that a discrete action is an index into.
    grid: Option<Vec<f64>>,
}

impl From<ActionOptions> for RangeMap {
    fn from(options: ActionOptions) -> Self {
        let (low, high) = (options.min_range, options.max_range);
        let step = (high - low) / (GRID_SIZE - 1) as f64;
        let even = || {
            let below = (0..GRID_SIZE - 1).map(|k| k as f64 * step + low);
            below.chain([high]).collect()
        };
        let grid = || options.range_grid.clone().unwrap_or_else(even);
        Self {
            grid: (options.action_mode == ActionMode::Discrete).then(grid),
            options,
        }
    }
}

impl RangeMap {
    /// Returns the ranges of discrete actions, in the order of their indices; `None` in other modes.
    pub fn grid(&self) -> Option<&[f64]> {
        self.grid.as_deref()
    }

    /// Returns the map of normalized actions.
    ///
    /// # Errors
    /// [`Error::Input`] in another mode.
    pub fn normalized(&self) -> Result<NormalizedRange> {
        let given = match self.options.action_mode {
            ActionMode::Normalized => return Ok(self.unit_map()),
            ActionMode::Range => "'range'",
            ActionMode::Discrete => "'discrete'",
        };
        Err(Error::input("action_mode", "'normalized'", given))
    }

    /// Returns the range of an action, a number or index, or NaN if it is outside of the action space.
    pub fn of(&self, action: f64) -> f64 {
        let ActionOptions {
            min_range,
            max_range,
            action_mode,
            ..
        } = self.options;
        match (&self.grid, action_mode) {
            (Some(grid), _) if action >= 0.0 => {
                grid.get(action as usize).copied().unwrap_or(f64::NAN)
            }
            (Some(_), _) => f64::NAN,
            (None, ActionMode::Normalized) => self.unit_map().of(clipped(action, -1.0, 1.0)),
            (None, _) => clipped(action, min_range, max_range),
        }
    }

    /// Returns the action that sets a range, up to rounding, or the index of the nearest range of the grid.
    ///
    /// # Errors
    /// [`Error::Input`] on `interaction_range` if it is out of bounds.
    pub fn action_of(&self, range: f64) -> Result<f64> {
        let (low, high) = (self.options.min_range, self.options.max_range);
        within_bounds("interaction_range", range, low, high)?;
        Ok(match (&self.grid, self.options.action_mode) {
            (Some(grid), _) => {
                let away = |k: &usize| (range - grid[*k]).abs();
                let nearest = |a: usize, b: usize| if away(&b) < away(&a) { b } else { a };
                (0..grid.len()).reduce(nearest).unwrap_or(0) as f64
            }
            (None, ActionMode::Normalized) => self.unit_map().action_of(range),
            (None, _) => range,
        })
    }

    fn unit_map(&self) -> NormalizedRange {
        NormalizedRange {
            min_range: self.options.min_range,
            max_range: self.options.max_range,
        }
    }
}

/// The linear map from actions in [-1, 1] to ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalizedRange {
    /// Range in m of the action -1.
    pub min_range: f64,
    /// Range in m of the action 1.
    pub max_range: f64,
}

impl NormalizedRange {
    /// Returns the range in m of an action in [-1, 1].
    pub fn of(&self, action: f64) -> f64 {
        self.min_range + (action + 1.0) / 2.0 * (self.max_range - self.min_range)
    }

    /// Returns the action in [-1, 1] of a range in m: [`Self::of`] returns this range up to rounding.
    fn action_of(&self, range: f64) -> f64 {
        (range - self.min_range) / (self.max_range - self.min_range) * 2.0 - 1.0
    }
}
