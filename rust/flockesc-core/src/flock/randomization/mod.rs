//! Domain randomization: every episode draws some numbers of the scenario from its seed.

mod distribution;
mod document;
#[cfg(test)]
mod tests;

pub use distribution::Distribution;
pub(super) use document::{check, draw};
