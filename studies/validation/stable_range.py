"""Is the group's best interaction range stable when each agent looks after itself? Mutants among residents.

Maynard Smith and Price, "The logic of animal conflict" (1973), define stability: no mutant does better.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, SymLogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flockesc_env import FlockScenario
from flockesc_env.common.stats import Estimate, FloatArray, argmax, mean
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.options import EnvOptions
from flockesc_env.scenario.presets import as_scenario
from studies.measurements import means, share_of, sign, split
from studies.style import letter
from studies.validation import Verdict
from training.figure_style import WIDTH

RANGES: Final = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 100.0, 150.0)
"""Interaction ranges of residents and mutants in m."""

PAYOFFS: Final = {"distance": ".2f", "nearest distance": ".2f", "survival": ".3f"}
"""What an agent looks after, and the format of its values."""

MUTANTS: Final = 30  # agents with the lowest ids; initial states do not depend on the id
PREY: Final = FlockScenario()
CAUGHT: Final = as_scenario("capture", FlockScenario)
FLOCKS: Final = 150  # of each split
SPLITS: Final = {"tuning": TUNING, "held_out": HELD_OUT}


@dataclass(frozen=True)
class Game:
    """The game of one payoff; ranges are chosen on ``TUNING`` flocks, estimates are of ``HELD_OUT`` flocks.

    ``group`` is the mean payoff of flocks without mutants and ``best`` the range where it is largest.
    ``advantage`` has a row per range of residents and a column per range of mutants. ``replies`` has, by
    range of residents, the mutants with the largest advantage among those whose interval is above 0, or the
    range itself if there are none. ``cycle`` has the ranges to which repeated replies from ``best`` lead, and
    ``price`` is the group's payoff at ``best`` minus its mean over the cycle. ``gain`` is how the reply to
    ``best`` changes the mutants' own payoff. ``control`` is the mean advantage, over all pairs of ranges, of
    agents that are drawn at random after the episode.
    """

    group: tuple[Estimate, ...]
    best: Estimate
    advantage: tuple[tuple[Estimate, ...], ...]
    replies: tuple[float, ...]
    cycle: tuple[float, ...]
    price: Estimate
    gain: Estimate
    control: Estimate

    def reply(self, resident: float) -> tuple[float, Estimate]:
        """Return the reply to a range, and its advantage."""
        at = RANGES.index(resident)
        return self.replies[at], self.advantage[at][RANGES.index(self.replies[at])]

    def stable(self) -> list[float]:
        """Return the ranges to which no other range is the reply."""
        return [a for a, reply in zip(RANGES, self.replies, strict=True) if a == reply]

    @property
    def is_invaded(self) -> bool:
        """Whether the reply to the group's best range has an advantage."""
        return self.reply(self.best.mean)[1].low > 0


@dataclass(frozen=True)
class StableRange:
    """The games by ``PAYOFFS``."""

    num_flocks: int
    games: dict[str, Game]


def play(
    scenario: FlockScenario, at: NDArray[np.int64], seeds: range, steps: int
) -> tuple[FloatArray, FloatArray]:
    """Return the agents' distances after every ``steps`` steps, and who survives, as 0 and 1.

    ``at`` are indices of ``RANGES``, shape (seeds, flocks per seed, agents).
    """
    grid: dict[str, Any] = {"action_mode": "discrete", "range_grid": RANGES, "max_range": RANGES[-1]}
    options = EnvOptions(**grid, steps_per_action=steps, reward="individual_distance", count_components=False)
    count = at.shape[0] * at.shape[1]
    batch = FlockBatch(scenario, options, num_flocks=count, per_agent=True, num_threads=1)
    batch.reset(range(count), np.repeat(seeds, at.shape[1]).tolist())
    rewards = [batch.step(at.ravel())[1] for _ in range(scenario.num_steps // steps)]
    distances = np.stack(rewards) * scenario.num_steps
    return distances.reshape(-1, *at.shape), np.where(batch.core.caught(), 0.0, 1.0).reshape(at.shape)


def payoffs(resident: float, seeds: range) -> FloatArray:
    """Return the payoffs of all agents, shape (payoffs, seeds, mutants' ranges, agents)."""
    at = np.full((len(seeds), len(RANGES), PREY.num_agents), RANGES.index(resident))
    at[..., :MUTANTS] = np.arange(len(RANGES))[:, None]
    distances, _ = play(PREY, at, seeds, 1)
    smallest = distances.mean(axis=-1).argmin(axis=0)
    now = np.take_along_axis(distances, smallest[None, ..., None], axis=0)[0]
    _, alive = play(CAUGHT, at, seeds, CAUGHT.num_steps)
    return np.stack([now, distances.min(axis=0), alive])


def measure(resident: float, seeds: range) -> Arrays:
    """Return the group's payoffs and the changes that mutants make, shape (payoffs, seeds, mutants' ranges).

    Changes are differences to the same agents of the same flock without mutants.
    """
    own, alike = payoffs(resident, seeds), RANGES.index(resident)
    change = own - own[:, :, [alike]]
    shuffled = np.random.default_rng((seeds[0], int(resident))).permuted(change, axis=-1)
    return {
        "group": own[:, :, alike].mean(axis=-1),
        "gain": change[..., :MUTANTS].mean(axis=-1),
        "advantage": change[..., :MUTANTS].mean(axis=-1) - change[..., MUTANTS:].mean(axis=-1),
        "shuffled": shuffled[..., :MUTANTS].mean(axis=-1) - shuffled[..., MUTANTS:].mean(axis=-1),
    }


def jobs(scale: float) -> dict[tuple[str, float], list[Job]]:
    """Return the jobs by split and range of the residents, for ``results``."""
    return {
        (name, a): split(f"{__name__}:measure", (a,), share_of(purpose, FLOCKS, scale, 4), 10, 0.2)
        for (name, purpose), a in product(SPLITS.items(), RANGES)
    }


def results(measured: Mapping[tuple[str, float], Arrays]) -> StableRange:
    """Return the results of the jobs of ``jobs``."""
    num_flocks = measured["held_out", RANGES[0]]["group"].shape[1]
    return StableRange(num_flocks, {name: _game(measured, at) for at, name in enumerate(PAYOFFS)})


def _game(measured: Mapping[tuple[str, float], Arrays], payoff: int) -> Game:
    def values(purpose: str, name: str) -> FloatArray:  # shape (residents, [mutants,] flocks)
        return np.array([measured[purpose, a][name][payoff].T for a in RANGES])

    best = argmax(np.array(RANGES), values("tuning", "group"))
    replies = [_reply(at, rows) for at, rows in enumerate(values("tuning", "advantage"))]
    start = RANGES.index(best.mean)
    path = [start]
    while replies[path[-1]] not in path:
        path.append(replies[path[-1]])
    cycle = path[path.index(replies[path[-1]]) :]
    group = values("held_out", "group")
    return Game(
        group=means(group),
        best=best,
        advantage=tuple(means(rows) for rows in values("held_out", "advantage")),
        replies=tuple(RANGES[reply] for reply in replies),
        cycle=tuple(RANGES[at] for at in cycle),
        price=mean(group[start] - group[cycle].mean(axis=0)),
        gain=mean(values("held_out", "gain")[start, replies[start]]),
        control=mean(values("held_out", "shuffled").mean(axis=(0, 1))),
    )


def _reply(resident: int, advantages: FloatArray) -> int:
    """Return the index of the reply to a range from the advantages, shape (mutants, flocks)."""
    invaders = [at for at, advantage in enumerate(means(advantages)) if advantage.low > 0]
    return max(invaders, key=lambda at: advantages[at].mean(), default=resident)


def verdict(results: StableRange) -> Verdict:
    """Return the verdict by the rule on the page."""
    return Verdict.of(not results.games["distance"].is_invaded)


def figure(results: StableRange) -> Figure:
    """Draw the advantage by ranges of residents and mutants, a panel per payoff."""
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    colors = LinearSegmentedColormap.from_list("advantage", (LIGHT.predator, LIGHT.page, LIGHT.accent))
    names = [f"{a:g}" for a in RANGES]
    for index, (name, game) in enumerate(results.games.items()):
        axes = figure.add_subplot(1, 3, index + 1)
        values = np.array([[e.mean * abs(sign(e)) for e in row] for row in game.advantage])
        most = np.abs(values).max()
        mesh = axes.imshow(
            values, cmap=colors, norm=SymLogNorm(most / 20, vmin=-most, vmax=most), origin="lower"
        )
        figure.colorbar(mesh, ax=axes, location="bottom", ticks=[-most, 0, most], format="%.2g")
        axes.plot([RANGES.index(reply) for reply in game.replies], range(len(RANGES)), ".", color=LIGHT.ink)
        at = RANGES.index(game.best.mean)
        axes.plot(at, at, "s", color=LIGHT.learned, mfc="none", ms=11)
        axes.set_xticks(range(len(RANGES)), names, rotation=90)
        axes.set_yticks(range(len(RANGES)), names)
        axes.set(xlabel="range of mutants (m)", ylabel="range of residents (m)")
        letter(axes, index, name)
    return figure
