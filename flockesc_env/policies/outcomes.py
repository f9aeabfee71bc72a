"""``Episodes`` and ``LineEpisodes``: outcomes of rollouts, one entry per seed."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final, Self

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.extras import data_frame
from flockesc_env.episodes.batch import Columns
from flockesc_env.models.simulate import Displayed, IntArray
from flockesc_env.models.sweep import FlockOutcomes

if TYPE_CHECKING:
    import polars as pl


class _Rows(Displayed):
    """Results with one entry per seed in every field."""

    @classmethod
    def of(cls, seeds: Sequence[int], columns: Columns) -> Self:
        """Return the columns of ``play``."""
        names = [field.name for field in fields(cls) if field.name != "seeds"]  # type: ignore[arg-type]
        return cls(seeds=np.array(seeds, np.uint64), **{name: columns[name] for name in names})  # type: ignore[call-arg]

    def table(self) -> "pl.DataFrame":
        """Return a polars DataFrame (extra ``analysis``) with one row per seed and a column per attribute."""
        columns = dict(vars(self))
        return data_frame({"seed": columns.pop("seeds"), **columns})


@dataclass(frozen=True, eq=False, repr=False)
class Episodes(FlockOutcomes, _Rows):
    """Results of ``rollout`` on flocks, one entry per seed.

    Inherits the attributes of ``FlockOutcomes``: the seeds and every objective, shape (seeds,).

    Attributes:
        num_components: number of connected components at the end, shape (seeds,).
        mean_return: undiscounted return, averaged over agents, shape (seeds,). The reward of a caught agent
            is 0.
        mean_range: mean range in m over steps and agents that were not caught, shape (seeds,).
        mean_heard: mean number of others that such an agent heard in a step, shape (seeds,).
    """

    num_components: IntArray
    mean_return: FloatArray
    mean_range: FloatArray
    mean_heard: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class LineEpisodes(_Rows):
    """Results of ``rollout`` on lines, one entry per seed.

    Attributes:
        seeds: the seeds, shape (seeds,).
        escape_distance: escape distance at the end of the episode, shape (seeds,); d_ss if ``converged``.
        num_components: number of connected components at the end, shape (seeds,).
        steps: number of model steps, shape (seeds,).
        converged: whether the line reached its steady state, shape (seeds,).
    """

    seeds: NDArray[np.uint64]
    escape_distance: FloatArray
    num_components: IntArray
    steps: IntArray
    converged: NDArray[np.bool]


RESULTS: Final[dict[str, type[Episodes | LineEpisodes]]] = {"flock": Episodes, "line": LineEpisodes}
"""Classes of outcomes by model."""
