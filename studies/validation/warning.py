"""The abstract of Saleh's paper: some connectivity helps because warnings spread. The control blocks them.

Worlds differ from the paper's flock in what a warning could depend on. In each, flocks fly under fixed ranges
twice: agents that no predator has reached hear those that one has reached, or they do not.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product, starmap
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom

from flockesc_env import FlockScenario, sweep
from flockesc_env.common.stats import CONFIDENCE, Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import AlignedHeadings, ConstantVelocity, PurePursuit, RandomHeadings, approach
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES
from flockesc_env.scenario.parts import InitialHeadings
from studies.measurements import share_of, split
from studies.style import letter, subplots
from studies.validation import Verdict

RANGES: Final = (0.0, 3.0, 6.0, 10.0, 15.0, 25.0, 40.0, 150.0)
"""Fixed ranges in m. A gain is over both ends: hearing nobody and hearing all."""

HEADINGS: Final[dict[str, InitialHeadings]] = {
    "random": RandomHeadings(),
    "across": AlignedHeadings((1.0, -1.0), 0.5),
    "toward": AlignedHeadings((-1.0, -1.0), 0.5),
}
"""Starts of the flock, by where it flies; the predator comes from the lower left."""

PREDATORS: Final = {"straight": ConstantVelocity, "pursuit": PurePursuit}
SPEEDS: Final = (200**0.5, 20.0)  # of the predator in m/s; the agents have 10 m/s
SENSING: Final = (15.0, 30.0, 60.0)  # distances in m within which agents flee
ALIGNMENTS: Final = (0.3, 1.0, 3.0)  # strengths of alignment
FLOCKS: Final = 50  # tuning flocks, and held-out flocks, in each world
PAPER_FLOCKS: Final = 1_000  # the same in the paper's own
CAPTURE_RADIUS: Final = 2.0  # in m, of pursuers
BY_CHANCE: Final = (1 - CONFIDENCE) / 2  # share of intervals that lie below a true value of 0


@dataclass(frozen=True)
class World:
    """What differs from the paper's flock."""

    headings: str
    predator: str
    speed: float
    sensing: float
    alignment: float
    captures: bool

    @property
    def scenario(self) -> FlockScenario:
        """The scenario."""
        return FlockScenario(
            initial_headings=HEADINGS[self.headings],
            predators=(PREDATORS[self.predator](*approach(speed=self.speed)),),
            predator_range=self.sensing,
            alignment_strength=self.alignment,
            capture_radius=CAPTURE_RADIUS if self.captures else None,
        )

    @property
    def objectives(self) -> tuple[str, ...]:
        """The objectives that are measured here."""
        return ("fraction_surviving",) if self.captures else ("min_mean_distance", "min_min_distance")


WORLDS: Final = tuple(
    world
    for world in starmap(World, product(HEADINGS, PREDATORS, SPEEDS, SENSING, ALIGNMENTS, (False, True)))
    if world.predator == "pursuit" or not world.captures
)
PAPER: Final = World("random", "straight", SPEEDS[0], 30.0, 1.0, captures=False)


@dataclass(frozen=True)
class Warned:
    """An objective in a world: its best fixed range and what a warning is worth, on held-out flocks.

    Units are m, or the share of agents. ``best`` is chosen on tuning flocks that hear warnings. ``value`` is
    the objective under the best range minus that under the best range of flocks that hear none, which is
    chosen on tuning flocks, too. ``hearing`` and ``blocked`` are gains of ``best`` over both ends of
    ``RANGES``, with and without warnings. ``removed`` is what blocking takes from the gain over the shortest
    range, minus half of it.
    """

    world: World
    objective: str
    best: float
    value: Estimate
    hearing: tuple[Estimate, Estimate]
    blocked: tuple[Estimate, Estimate]
    removed: Estimate

    @property
    def decides(self) -> bool:
        """Whether the best range gains over both ends, and blocking removes both gains."""
        return all(gain.low > 0 for gain in self.hearing) and all(gain.low <= 0 for gain in self.blocked)


@dataclass(frozen=True)
class ValueOfWarnings:
    """The results in every world, and the number of held-out flocks in most of them and in the paper's."""

    worlds: tuple[Warned, ...]
    num_flocks: tuple[int, int]

    @property
    def paper(self) -> list[Warned]:
        """The paper's own flock."""
        return [each for each in self.worlds if each.world == PAPER]

    @property
    def decided(self) -> list[Warned]:
        """The worlds in which hearing the warned decides, the clearest first."""
        return sorted((each for each in self.worlds if each.decides), key=lambda each: -each.value.low)


def play(world: World, seeds: range) -> Arrays:
    """Return every objective under ``RANGES`` of flocks that hear warnings, and of those that hear none."""
    found: Arrays = {}
    for name, is_blocked in (("hearing", False), ("blocked", True)):
        flocks = sweep(world.scenario.replace(blocks_warnings=is_blocked), RANGES, seeds)
        found |= {f"{name} {objective}": getattr(flocks, objective) for objective in world.objectives}
    return found


def jobs(scale: float) -> dict[tuple[World, str], list[Job]]:
    """Return the jobs by world and split, for ``results``."""
    found: dict[tuple[World, str], list[Job]] = {}
    for world, (purpose, seeds) in product(WORLDS, {"tuning": TUNING, "held-out": HELD_OUT}.items()):
        flocks = share_of(seeds, PAPER_FLOCKS if world == PAPER else FLOCKS, scale, least=4)
        found[world, purpose] = split(play, world, flocks=flocks, size=50, seconds=0.3)
    return found


def results(measured: Mapping[tuple[World, str], Arrays]) -> ValueOfWarnings:
    """Return the results of the jobs of ``jobs``."""
    worlds = tuple(_warned(world, one, measured) for world in WORLDS for one in world.objectives)
    most, paper = (measured[world, "held-out"]["hearing min_mean_distance"] for world in (WORLDS[1], PAPER))
    return ValueOfWarnings(worlds, num_flocks=(most.shape[1], paper.shape[1]))


def _warned(world: World, objective: str, measured: Mapping[tuple[World, str], Arrays]) -> Warned:
    """Return the result for an objective in a world."""
    tuning, held_out = measured[world, "tuning"], measured[world, "held-out"]
    hearing, blocked = held_out[f"hearing {objective}"], held_out[f"blocked {objective}"]  # (ranges, flocks)
    best = int(tuning[f"hearing {objective}"].mean(axis=1).argmax())
    best_blocked = int(tuning[f"blocked {objective}"].mean(axis=1).argmax())
    gain, gain_blocked = hearing[best] - hearing[0], blocked[best] - blocked[0]
    return Warned(
        world=world,
        objective=objective,
        best=RANGES[best],
        value=mean(hearing[best] - blocked[best_blocked]),
        hearing=(mean(gain), mean(hearing[best] - hearing[-1])),
        blocked=(mean(gain_blocked), mean(blocked[best] - blocked[-1])),
        removed=mean(gain / 2 - gain_blocked),
    )


def probability(count: int, pairs: int) -> float:
    """Return the probability that ``count`` or more of some intervals lie below a true value of 0."""
    return float(binom.sf(count - 1, pairs, BY_CHANCE))


def verdict(results: ValueOfWarnings) -> Verdict:
    """Return the verdict by the rule on the page."""
    return Verdict.of(*(each.removed.low > 0 for each in results.paper))


def figure(results: ValueOfWarnings) -> Figure:
    """Draw the map: what a warning is worth in every world, one panel per objective."""
    figure, panels = subplots(5.0, 1, 3)
    columns = tuple(product(SENSING, ALIGNMENTS))
    for index, (axes, spec) in enumerate(zip(panels, FLOCK_OBJECTIVES.values(), strict=True)):
        shown = [each for each in results.worlds if each.objective == spec.name]
        rows = list(dict.fromkeys(_row(each.world) for each in shown))
        values = np.full((len(rows), len(columns)), np.nan)
        for each in shown:
            row = rows.index(_row(each.world))
            column = columns.index((each.world.sensing, each.world.alignment))
            values[row, column] = each.value.mean
            if each.decides:
                axes.plot(column, row, "o", color=LIGHT.ink, ms=5)
            if each.world == PAPER:
                axes.plot(column, row, "s", mfc="none", mec=LIGHT.ink, ms=12)
        most = np.nanmax(np.abs(values))
        image = axes.imshow(values, cmap="PuOr_r", vmin=-most, vmax=most, aspect="auto")
        label, ticks = spec.with_unit("value of a warning"), (-most, 0, most)
        figure.colorbar(image, ax=axes, location="bottom", label=label, ticks=ticks, format="%.2g")
        axes.set_xticks(range(len(columns)), [f"{sensing:g} m, {a:g}" for sensing, a in columns], rotation=90)
        axes.set_yticks(range(len(rows)), [] if index == 1 else rows)  # (b) has the rows of (a)
        axes.tick_params(labelsize="small")
        axes.set_xlabel("flees within, alignment")
        letter(axes, index, spec.symbol)
    return figure


def _row(world: World) -> str:
    """Return the name of the row of a world in the figure."""
    return f"{world.headings}, {world.predator}, {world.speed:.0f} m/s"
