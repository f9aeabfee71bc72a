//! `Maker`: a serde deserializer that generates values of any type from bytes.
//!
//! New parts of scenarios need no change here. Only numbers with narrow bounds are special cases, by the
//! names of their fields.

use arbitrary::{Result, Unstructured};
use serde::de::value::Error as Refused;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use crate::numbers::{LARGEST, any_range, coordinate, quantity, rarely};

/// Generated values on which the bounds of later values depend.
#[derive(Default)]
pub(crate) struct Context {
    num_agents: usize,
    dimension: usize,
    has_max_speed: bool,
    target: &'static str,
}

/// Generates one value in the field of this name. `depth` is the number of enclosing lists in the field.
pub(crate) struct Maker<'a, 'u> {
    u: &'a mut Unstructured<'u>,
    context: &'a mut Context,
    field: &'static str,
    depth: usize,
}

impl<'a, 'u> Maker<'a, 'u> {
    pub(crate) fn new(u: &'a mut Unstructured<'u>, context: &'a mut Context) -> Self {
        Self {
            u,
            context,
            field: "",
            depth: 0,
        }
    }

    fn with(&mut self, field: &'static str, depth: usize) -> Maker<'_, 'u> {
        Maker {
            u: self.u,
            context: self.context,
            field,
            depth,
        }
    }

    fn number(&mut self) -> Result<f64> {
        let u = &mut *self.u;
        match self.field {
            _ if self.depth > 0 => coordinate(u),
            "time_step" | "mass" | "speed" | "initial_side" | "max_range" | "radius"
            | "interval" => Ok(quantity(u)?.max(1e-20)),
            "max_speed" => Ok(LARGEST),
            "acceleration" if !self.context.has_max_speed => Ok(0.0),
            "confusion_rate" if self.context.target != "nearest" => Ok(0.0),
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
            "num_agents" => self.context.num_agents = count,
            "dimension" => self.context.dimension = count,
            _ => {}
        }
        Ok(count)
    }

    fn length(&mut self) -> Result<usize> {
        match self.field {
            "predators" => self.u.int_in_range(1..=4),
            "randomization" => Ok(usize::from(rarely(self.u, 8)?)),
            "values" => self.u.int_in_range(1..=3),
            "points" | "directions" if self.depth == 0 => Ok(self.context.num_agents),
            _ => Ok(self.context.dimension),
        }
    }
}

fn generated<T>(value: Result<T>) -> std::result::Result<T, Refused> {
    value.map_err(Refused::custom)
}

impl<'de> Deserializer<'de> for Maker<'_, '_> {
    type Error = Refused;

    /// Generates a number, a list of one number per agent, or the name that an option accepts instead of a
    /// number.
    fn deserialize_any<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        if self.field == "predator_sensing_range" {
            return match generated(self.u.arbitrary())? {
                true => visitor.visit_str("predator_range"),
                false => visitor.visit_f64(generated(any_range(self.u))?),
            };
        }
        if generated(rarely(self.u, 4))? {
            let left = self.context.num_agents;
            return visitor.visit_seq(List { maker: self, left });
        }
        visitor.visit_f64(generated(self.number())?)
    }

    fn deserialize_f64<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_f64(generated(self.number())?)
    }

    fn deserialize_u64<V: Visitor<'de>>(
        mut self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_u64(generated(self.count())? as u64)
    }

    fn deserialize_bool<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        let is_rare = generated(rarely(self.u, 6))?;
        visitor.visit_bool(is_rare != (self.field == "constant_speed"))
    }

    /// Generates the path of a randomized number.
    fn deserialize_string<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        visitor.visit_str(generated(self.u.choose(&["predator_range", "speed"]))?)
    }

    fn deserialize_option<V: Visitor<'de>>(
        self,
        visitor: V,
    ) -> std::result::Result<V::Value, Refused> {
        // A periodic domain has no predators.
        let is_some = self.field != "periodic_side" && generated(self.u.ratio(1, 2))?;
        if self.field == "max_speed" {
            self.context.has_max_speed = is_some;
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
        let left = generated(self.length())?;
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
        let variant = *generated(self.u.choose(variants))?;
        if self.field == "target" {
            self.context.target = variant;
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

/// The remaining values of a list.
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

/// The remaining fields of a struct.
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

/// A variant of an enum.
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
