"""Tables of episodes: a row per flock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl

from flockesc_env.common.stats import FloatArray

_NUMBERS = {"training_seed": pl.Int64, "interaction_range": pl.Float64}
"""Types of labels that can be null."""


def rows(seeds: Sequence[int], objective: FloatArray, **labels: Any) -> pl.DataFrame:
    """Return a table with a row per flock: the labels, the seed and the objective."""
    columns = {
        name: pl.Series(values=[label] * len(seeds), dtype=_NUMBERS.get(name))
        for name, label in labels.items()
    }
    return pl.DataFrame(
        {
            **columns,
            "seed": pl.Series(values=seeds, dtype=pl.Int64),
            "objective": pl.Series(values=objective, dtype=pl.Float64),
        }
    )


def values_by(table: pl.DataFrame, *keys: str, column: str = "objective") -> dict[Any, FloatArray]:
    """Return a column, flocks in rising order, by the value of a column or by the values of several."""
    return {
        key if len(keys) > 1 else key[0]: part.sort("seed")[column].to_numpy()
        for key, part in table.group_by(*keys, maintain_order=True)
    }
