//! Scenarios, options, ranges and places made of bytes: mostly ordinary ones, and the edges of what is accepted.
//!
//! [`Maker`] makes any type of the core that can be read from a document: it answers what serde asks for. So new parts of
//! scenarios are made without a change here; numbers with narrow bounds are known by the names of their fields.

use arbitrary::{Error, Result, Unstructured};
use flockesc_core::{EpisodeConfig, FlockConfig};
use serde::de::value::Error as Refused;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};
use serde::{Deserialize, forward_to_deserialize_any};

const LARGEST: f64 = 1e20;
const EDGES: [f64; 12] = [
    0.0, 5e-324, 1e-160, 1e-140, 1e-20, 1e-9, 0.5, 1.0, 3.0, 10.0, 1e12, LARGEST,
];

/// A scenario with predators and the options of an environment, both accepted.
pub fn documents(u: &mut Unstructured<'_>) -> Result<(FlockConfig, EpisodeConfig)> {
    let mut facts = Facts::default();
    let refused = |_| Error::IncorrectFormat;
    let scenario = FlockConfig::deserialize(Maker::new(u, &mut facts)).map_err(refused)?;
    let options = EpisodeConfig::deserialize(Maker::new(u, &mut facts)).map_err(refused)?;
    scenario.check().map_err(|_| Error::IncorrectFormat)?;
    options.check().map_err(|_| Error::IncorrectFormat)?;
    Ok((scenario, options))
}

/// True once in `times`, and never without further bytes: what they leave out is ordinary.
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

/// Any interaction range: a small one, an edge, or the largest number.
pub fn any_range(u: &mut Unstructured<'_>) -> Result<f64> {
    match rarely(u, 8)? {
        true => Ok(f64::MAX),
        false => quantity(u),
    }
}

/// A coordinate, often a small integer, so that many are equal.
fn coordinate(u: &mut Unstructured<'_>) -> Result<f64> {
    match u.arbitrary()? {
        true => Ok(f64::from(u.int_in_range(-2..=2)?)),
        false if u.arbitrary()? => Ok(-quantity(u)?),
        false => quantity(u),
    }
}

/// `count` coordinates.
pub fn coordinates(u: &mut Unstructured<'_>, count: usize) -> Result<Vec<f64>> {
    (0..count).map(|_| coordinate(u)).collect()
}

/// What was made so far that bounds what follows.
#[derive(Default)]
struct Facts {
    num_agents: usize,
    dimension: usize,
    has_max_speed: bool,
    target: &'static str,
}

/// Makes one value, in the field of this name and in lists of this depth in it.
struct Maker<'a, 'u> {
    u: &'a mut Unstructured<'u>,
    facts: &'a mut Facts,
    field: &'static str,
    depth: usize,
}

impl<'a, 'u> Maker<'a, 'u> {
    fn new(u: &'a mut Unstructured<'u>, facts: &'a mut Facts) -> Self {
        Self {
            u,
            facts,
            field: "",
            depth: 0,
        }
    }

    fn with(&mut self, field: &'static str, depth: usize) -> Maker<'_, 'u> {
        Maker {
            u: self.u,
            facts: self.facts,
            field,
            depth,
        }
    }

    fn number(&mut self) -> Result<f64> {
        let u = &mut *self.u;
        match self.field {
            _ if self.depth > 0 => coordinate(u),
            "time_step" | "mass" | "speed" | "initial_side" | "max_range" | "radius" => {
                Ok(quantity(u)?.max(1e-20))
            }
            "max_speed" => Ok(LARGEST),
            "acceleration" if !self.facts.has_max_speed => Ok(0.0),
            "confusion_rate" if self.facts.target != "nearest" => Ok(0.0),
            "predator_range" | "capture_radius" | "sight" | "separation_range" => any_range(u),
            "angular_noise" | "blind_angle" | "sensing_noise" if !rarely(u, 4)? => Ok(0.0),
            "angular_noise" | "blind_angle" => Ok(2.0),
            _ => quantity(u),
        }
    }

    fn count(&mut self) -> Result<usize> {
        let u = &mut *self.u;
        let count = match self.field {
            "num_agents" if rarely(u, 8)? => u.int_in_range(60..=140),
            "num_agents" | "num_steps" => u.int_in_range(1..=12),
            "dimension" => u.int_in_range(2..=3),
            "steps_per_action" | "num_clusters" => u.int_in_range(1..=3),
            "sensing_delay" if !rarely(u, 4)? => Ok(0),
            _ => u.int_in_range(0..=3),
        }?;
        match self.field {
            "num_agents" => self.facts.num_agents = count,
            "dimension" => self.facts.dimension = count,
            _ => {}
        }
        Ok(count)
    }

    fn length(&mut self) -> Result<usize> {
        match self.field {
            "predators" => self.u.int_in_range(1..=4),
            "randomization" => Ok(usize::from(rarely(self.u, 8)?)),
            "values" => self.u.int_in_range(1..=3),
            "points" | "directions" if self.depth == 0 => Ok(self.facts.num_agents),
            _ => Ok(self.facts.dimension),
        }
    }
}

fn made<T>(value: Result<T>) -> std::result::Result<T, Refused> {
    value.map_err(Refused::custom)
}

impl<'de> Deserializer<'de> for Maker<'_, '_> {
    type Error = Refused;

    /// A number, one per agent, or the name that an option takes instead of a number.
    fn deserialize_any<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        if self.field == "predator_sensing_range" {
            return match made(self.u.arbitrary())? {
                true => visitor.visit_str("predator_range"),
                false => visitor.visit_f64(made(any_range(self.u))?),
            };
        }
        if made(rarely(self.u, 4))? {
            let left = self.facts.num_agents;
            return visitor.visit_seq(List { maker: self, left });
        }
        visitor.visit_f64(made(self.number())?)
    }

    fn deserialize_f64<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_f64(made(self.number())?)
    }

    fn deserialize_u64<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_u64(made(self.count())? as u64)
    }

    fn deserialize_bool<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        let is_rare = made(rarely(self.u, 6))?;
        visitor.visit_bool(is_rare != (self.field == "constant_speed"))
    }

    /// The field of a distribution.
    fn deserialize_string<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_str(made(self.u.choose(&["predator_range", "speed"]))?)
    }

    fn deserialize_option<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        // A world without border has no predators.
        let is_some = self.field != "periodic_side" && made(self.u.ratio(1, 2))?;
        if self.field == "max_speed" {
            self.facts.has_max_speed = is_some;
        }
        match is_some {
            true => visitor.visit_some(self),
            false => visitor.visit_none(),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        let left = made(self.length())?;
        self.depth += 1;
        visitor.visit_seq(List { maker: self, left })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        let maker = self;
        visitor.visit_map(Fields { maker, fields })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        mut self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        let variant = *made(self.u.choose(variants))?;
        if self.field == "target" {
            self.facts.target = variant;
        }
        self.depth = 0;
        visitor.visit_enum(Variant {
            maker: self,
            variant,
        })
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u128 f32 char str bytes byte_buf unit unit_struct newtype_struct
        tuple tuple_struct map identifier ignored_any
    }
}

/// So many values of the same field.
struct List<'a, 'u> {
    maker: Maker<'a, 'u>,
    left: usize,
}

impl<'de> SeqAccess<'de> for List<'_, '_> {
    type Error = Refused;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> std::result::Result<Option<T::Value>, Refused> {
        let Some(left) = self.left.checked_sub(1) else {
            return Ok(None);
        };
        self.left = left;
        let (field, depth) = (self.maker.field, self.maker.depth);
        seed.deserialize(self.maker.with(field, depth)).map(Some)
    }
}

/// The fields of a struct that are left.
struct Fields<'a, 'u> {
    maker: Maker<'a, 'u>,
    fields: &'static [&'static str],
}

impl<'de> MapAccess<'de> for Fields<'_, '_> {
    type Error = Refused;

    fn next_key_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> std::result::Result<Option<T::Value>, Refused> {
        let Some((field, left)) = self.fields.split_first() else {
            return Ok(None);
        };
        (self.maker.field, self.fields) = (field, left);
        seed.deserialize((*field).into_deserializer()).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> std::result::Result<T::Value, Refused> {
        let field = self.maker.field;
        seed.deserialize(self.maker.with(field, 0))
    }
}

/// One variant of an enum.
struct Variant<'a, 'u> {
    maker: Maker<'a, 'u>,
    variant: &'static str,
}

impl<'de, 'a, 'u> EnumAccess<'de> for Variant<'a, 'u> {
    type Error = Refused;
    type Variant = Maker<'a, 'u>;

    fn variant_seed<T: DeserializeSeed<'de>>(
        self,
        seed: T,
    ) -> std::result::Result<(T::Value, Maker<'a, 'u>), Refused> {
        let value = seed.deserialize(self.variant.into_deserializer())?;
        Ok((value, self.maker))
    }
}

impl<'de> VariantAccess<'de> for Maker<'_, '_> {
    type Error = Refused;

    fn unit_variant(self) -> std::result::Result<(), Refused> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(
        self,
        seed: T,
    ) -> std::result::Result<T::Value, Refused> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(
        self,
        _length: usize,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        self.deserialize_seq(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        self.deserialize_struct("", fields, visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Every part is made, and a good share of the scenarios is accepted.
    #[test]
    fn makes_every_part() {
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
