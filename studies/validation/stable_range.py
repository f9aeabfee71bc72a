"""Is the group's best interaction range stable when each agent looks after itself? Mutants among residents.

Maynard Smith and Price, "The logic of animal conflict" (1973), define stability: no mutant does better.
"""

from collections.abc import Collection, Mapping
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
from studies.style import letter, subplots
from studies.validation import Verdict

RANGES: Final = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 100.0, 150.0)
"""Interaction ranges of residents and mutants in m."""

PAYOFFS: Final = {"distance": ".2f", "nearest distance": ".2f", "survival": ".3f"}
"""What an agent looks after, and the format of its values."""

MUTANTS: Final = 30  # agents with the lowest ids; initial states do not depend on the id
PREY: Final = FlockScenario()
CAUGHT: Final = as_scenario("capture", FlockScenario)
FLOCKS: Final = 150  # of each split
POPULATIONS: Final = 3  # of the replicator dynamics
GENERATIONS: Final = 500
FLOCKS_PER_GENERATION: Final = 2
SELECTION: Final = 0.3  # growth of a share for an advantage of one standard deviation of the agents' payoffs
MUTATION: Final = 0.002  # share of the agents that draw a range at random in a generation
SPLITS: Final = {"tuning": TUNING, "held_out": HELD_OUT}


@dataclass(frozen=True)
class Game:
    """The game of one payoff; ranges are chosen on ``TUNING`` flocks, estimates are of ``HELD_OUT`` flocks.

    ``group`` is the mean payoff of flocks without mutants and ``best`` the range where it is largest.
    ``advantage`` has a row per range of residents and a column per range of mutants. ``replies`` has, by
    range of residents, the mutants with the largest advantage among those whose interval is above 0, or the
    range itself if there are none. ``mix`` has the shares of the ranges in the second half of the
    generations, and ``price`` is the group's payoff at ``best`` minus that in the mix. ``gain`` is how the
    reply to ``best`` changes the mutants' own payoff. ``control`` is the mean advantage, over all pairs of
    ranges, of agents that are drawn at random after the episode.
    """

    group: tuple[Estimate, ...]
    best: Estimate
    advantage: tuple[tuple[Estimate, ...], ...]
    replies: tuple[float, ...]
    mix: tuple[Estimate, ...]
    price: Estimate
    gain: Estimate
    control: Estimate

    def reply(self, resident: float) -> tuple[float, Estimate]:
        """Return the reply to a range, and its advantage."""
        at = RANGES.index(resident)
        return self.replies[at], self.advantage[at][RANGES.index(self.replies[at])]

    def stable(self) -> list[float]:
        """Return the ranges to which no other range is the reply."""
        return [resident for resident, reply in zip(RANGES, self.replies, strict=True) if resident == reply]

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
    scenario: FlockScenario, ranges: NDArray[np.int64], seeds: range, steps: int
) -> tuple[FloatArray, FloatArray]:
    """Return the agents' distances in m after every ``steps`` steps, and who survives, as 0 and 1.

    ``ranges`` are indices of ``RANGES``, shape (seeds, flocks per seed, agents).
    """
    grid: dict[str, Any] = {"action_mode": "discrete", "range_grid": RANGES, "max_range": RANGES[-1]}
    options = EnvOptions(**grid, steps_per_action=steps, reward="individual_distance", count_components=False)
    flocks_per_seed = ranges.shape[1]
    count = len(seeds) * flocks_per_seed
    batch = FlockBatch(scenario, options, num_flocks=count, per_agent=True, num_threads=1)
    batch.reset(range(count), np.repeat(seeds, flocks_per_seed).tolist())
    rewards = [batch.step(ranges.ravel())[1] for _ in range(scenario.num_steps // steps)]
    distances = np.stack(rewards) * scenario.num_steps
    alive = np.where(batch.core.caught(), 0.0, 1.0)
    return distances.reshape(-1, *ranges.shape), alive.reshape(ranges.shape)


def payoffs(
    ranges: NDArray[np.int64], seeds: range, names: Collection[str] = PAYOFFS
) -> dict[str, FloatArray]:
    """Return some payoffs of all agents by name, shape (seeds, flocks per seed, agents); as ``play``."""
    found = {}
    if names != {"survival"}:
        distances, _ = play(PREY, ranges, seeds, steps=1)
        smallest = distances.mean(axis=-1).argmin(axis=0)  # the step of the smallest mean distance
        found["distance"] = np.take_along_axis(distances, smallest[None, ..., None], axis=0)[0]
        found["nearest distance"] = distances.min(axis=0)
    if "survival" in names:
        _, found["survival"] = play(CAUGHT, ranges, seeds, steps=CAUGHT.num_steps)
    return found


def evolve(payoff: str, populations: range, seeds: range) -> Arrays:
    """Return the replicator dynamics of populations, which begin with equal shares of all ranges.

    In every generation agents draw their ranges from the shares. A share grows by ``SELECTION`` times the
    advantage of its agents over their flocks, in standard deviations of the payoff.

    Returns:
        ``mix``, the mean shares over the second half of the generations, shape (ranges, populations);
        ``group``, the payoff of flocks that draw their ranges from the mean mix, shape (flocks,).
    """
    rng, count, mixes = np.random.default_rng(populations[0]), len(RANGES), []
    for population in populations:
        shares, history = np.full(count, 1 / count), []
        for generation in range(GENERATIONS):
            begin = population + generation * FLOCKS_PER_GENERATION
            flocks = range(begin, begin + FLOCKS_PER_GENERATION)
            ranges = rng.choice(count, (FLOCKS_PER_GENERATION, 1, PREY.num_agents), p=shares)
            found = payoffs(ranges, flocks, {payoff})[payoff]
            found = (found - found.mean(axis=-1, keepdims=True)) / max(found.std(), 1e-12)
            counts, sums = (np.bincount(ranges.ravel(), w, count) for w in (None, found.ravel()))
            shares = shares * np.maximum(1 + SELECTION * sums / np.maximum(counts, 1), 0)
            shares = (1 - MUTATION) * shares / shares.sum() + MUTATION / count
            history.append(shares)
        mixes.append(np.mean(history[GENERATIONS // 2 :], axis=0))
    drawn = rng.choice(count, (len(seeds), 1, PREY.num_agents), p=np.mean(mixes, axis=0))
    return {"mix": np.array(mixes).T, "group": payoffs(drawn, seeds, {payoff})[payoff].mean(axis=(1, 2))}


def measure(resident: float, seeds: range) -> Arrays:
    """Return the group's payoffs and the changes that mutants make.

    Changes are differences to the same agents of the same flock without mutants.

    Returns:
        ``group``, shape (payoffs, seeds); ``gain``, ``advantage`` and ``shuffled``, shape (payoffs, seeds,
        mutants' ranges). ``shuffled`` is the advantage of agents that are drawn at random.
    """
    ranges = np.full((len(seeds), len(RANGES), PREY.num_agents), RANGES.index(resident))
    ranges[..., :MUTANTS] = np.arange(len(RANGES))[:, None]
    found = np.stack([*payoffs(ranges, seeds).values()])
    without_mutants = found[:, :, [RANGES.index(resident)]]
    change = found - without_mutants
    shuffled = np.random.default_rng((seeds[0], int(resident))).permuted(change, axis=-1)
    return {
        "group": without_mutants[:, :, 0].mean(axis=-1),
        "gain": change[..., :MUTANTS].mean(axis=-1),
        "advantage": change[..., :MUTANTS].mean(axis=-1) - change[..., MUTANTS:].mean(axis=-1),
        "shuffled": shuffled[..., :MUTANTS].mean(axis=-1) - shuffled[..., MUTANTS:].mean(axis=-1),
    }


def jobs(scale: float) -> dict[tuple[str, float], list[Job]]:
    """Return the jobs by split and range of the residents, and of the mixes by payoff, for ``results``."""
    seeds = {name: share_of(purpose, FLOCKS, scale, least=4) for name, purpose in SPLITS.items()}
    found = {
        (name, resident): split(measure, resident, flocks=seeds[name], size=10, seconds=0.2)
        for name, resident in product(SPLITS, RANGES)
    }
    starts = TUNING[FLOCKS :: FLOCKS_PER_GENERATION * GENERATIONS][:POPULATIONS]
    for at, payoff in enumerate(PAYOFFS):
        found["mix", at] = [Job(f"{__name__}:evolve", (payoff, starts, seeds["held_out"]), 100.0)]
    return found


def results(measured: Mapping[tuple[str, float], Arrays]) -> StableRange:
    """Return the results of the jobs of ``jobs``."""
    num_flocks = measured["held_out", RANGES[0]]["group"].shape[1]
    return StableRange(num_flocks, {name: _game(measured, at) for at, name in enumerate(PAYOFFS)})


def _game(measured: Mapping[tuple[str, float], Arrays], payoff: int) -> Game:
    def values(purpose: str, name: str) -> FloatArray:
        """Return an array of ``measure`` by resident; shape (residents, [mutants' ranges,] flocks)."""
        return np.array([measured[purpose, resident][name][payoff].T for resident in RANGES])

    mixed = measured["mix", payoff]
    best = argmax(np.array(RANGES), values("tuning", "group"))
    replies = []
    for resident, rows in enumerate(values("tuning", "advantage")):
        invaders = [mutant for mutant, advantage in enumerate(means(rows)) if advantage.low > 0]
        replies.append(max(invaders, key=lambda mutant: rows[mutant].mean(), default=resident))
    start = RANGES.index(best.mean)
    group = values("held_out", "group")
    return Game(
        group=means(group),
        best=best,
        advantage=tuple(means(rows) for rows in values("held_out", "advantage")),
        replies=tuple(RANGES[reply] for reply in replies),
        mix=means(mixed["mix"]),
        price=mean(group[start] - mixed["group"]),
        gain=mean(values("held_out", "gain")[start, replies[start]]),
        control=mean(values("held_out", "shuffled").mean(axis=(0, 1))),
    )


def verdict(results: StableRange) -> Verdict:
    """Return the verdict by the rule on the page."""
    return Verdict.of(not results.games["distance"].is_invaded)


def figure(results: StableRange) -> Figure:
    """Draw the advantage by ranges of residents and mutants, a panel per payoff."""
    figure, panels = subplots(3.4, 1, len(PAYOFFS))
    colors = LinearSegmentedColormap.from_list("advantage", (LIGHT.predator, LIGHT.page, LIGHT.accent))
    names = [f"{rho:g}" for rho in RANGES]
    for index, (axes, (name, game)) in enumerate(zip(panels, results.games.items(), strict=True)):
        # A cell whose interval includes 0 is blank.
        shown = np.array([[cell.mean * abs(sign(cell)) for cell in row] for row in game.advantage])
        most = np.abs(shown).max()
        norm = SymLogNorm(most / 20, vmin=-most, vmax=most)
        mesh = axes.imshow(shown, cmap=colors, norm=norm, origin="lower")
        figure.colorbar(mesh, ax=axes, location="bottom", ticks=[-most, 0, most], format="%.2g")
        axes.plot([RANGES.index(reply) for reply in game.replies], range(len(RANGES)), ".", color=LIGHT.ink)
        best = RANGES.index(game.best.mean)
        axes.plot(best, best, "s", color=LIGHT.learned, mfc="none", ms=11)
        axes.set_xticks(range(len(RANGES)), names, rotation=90)
        axes.set_yticks(range(len(RANGES)), names)
        axes.set(xlabel="range of mutants (m)", ylabel="range of residents (m)")
        letter(axes, index, name)
    return figure
