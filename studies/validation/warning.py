"""The abstract of Saleh's paper: some connectivity helps because warnings spread. The control blocks them.

Worlds differ from the paper's flock in what a warning could depend on. In each, flocks fly under fixed ranges
twice: agents that no predator has reached hear those that one has reached, or they do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, sweep
from flockesc_env.common.stats import Estimate, mean
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
    World(*world, captures)
    for world in product(HEADINGS, PREDATORS, SPEEDS, SENSING, ALIGNMENTS)
    for captures in (False, True)
    if world[1] == "pursuit" or not captures
)
PAPER: Final = World("random", "straight", SPEEDS[0], 30.0, 1.0, captures=False)


@dataclass(frozen=True)
class Warned:
    """An objective in a world: its best fixed range and what a warning is worth, on held-out flocks.

    Units are m, or the share of agents. ``best`` is chosen on tuning flocks that hear warnings. ``value`` is
    the objective under the best range minus that under the best range of flocks that hear none, which is
    chosen on tuning flocks, too. ``hearing`` and ``blocked`` are gains of ``best`` over the shortest and the
    longest range. ``removed`` is what blocking takes from the gain over the shortest one, minus half of it.
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
    found = {
        name: sweep(world.scenario.replace(blocks_warnings=name == "blocked"), RANGES, seeds)
        for name in ("hearing", "blocked")
    }
    return {f"{name} {one}": getattr(found[name], one) for name in found for one in world.objectives}


def jobs(scale: float) -> dict[tuple[World, str], list[Job]]:
    """Return the jobs by world and split, for ``results``."""
    return {
        (world, purpose): split(f"{__name__}:play", (world,), share_of(of, count, scale, 4), 50, 0.3)
        for world in WORLDS
        for count in [PAPER_FLOCKS if world == PAPER else FLOCKS]
        for purpose, of in (("tuning", TUNING), ("held-out", HELD_OUT))
    }


def results(measured: Mapping[tuple[World, str], Arrays]) -> ValueOfWarnings:
    """Return the results of the jobs of ``jobs``."""
    worlds = tuple(_warned(world, one, measured) for world in WORLDS for one in world.objectives)
    few, many = (measured[world, "held-out"]["hearing min_mean_distance"] for world in (WORLDS[1], PAPER))
    return ValueOfWarnings(worlds, (len(few[0]), len(many[0])))


def _warned(world: World, objective: str, measured: Mapping[tuple[World, str], Arrays]) -> Warned:
    names = f"hearing {objective}", f"blocked {objective}"
    best, without = (int(measured[world, "tuning"][name].mean(axis=1).argmax()) for name in names)
    hearing, blocked = (measured[world, "held-out"][name] for name in names)
    gains, left = hearing[best] - hearing[[0, -1]], blocked[best] - blocked[[0, -1]]
    return Warned(
        world=world,
        objective=objective,
        best=RANGES[best],
        value=mean(hearing[best] - blocked[without]),
        hearing=(mean(gains[0]), mean(gains[1])),
        blocked=(mean(left[0]), mean(left[1])),
        removed=mean(gains[0] / 2 - left[0]),
    )


def verdict(results: ValueOfWarnings) -> Verdict:
    """Return the verdict by the rule on the page."""
    return Verdict.of(*(each.removed.low > 0 for each in results.paper))


def figure(results: ValueOfWarnings) -> Figure:
    """Draw the map: what a warning is worth in every world, one panel per objective."""
    figure, panels = subplots(5.0, 1, 3)
    columns = tuple(product(SENSING, ALIGNMENTS))
    for index, (axes, spec) in enumerate(zip(panels, FLOCK_OBJECTIVES.values(), strict=True)):
        shown = [each for each in results.worlds if each.objective == spec.name]
        worlds = [(each.world.headings, each.world.predator, each.world.speed) for each in shown]
        rows = list(dict.fromkeys(worlds))
        values = np.full((len(rows), len(columns)), np.nan)
        for each, world in zip(shown, worlds, strict=True):
            row, column = rows.index(world), columns.index((each.world.sensing, each.world.alignment))
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
        names = [f"{start}, {kind}, {speed:.0f} m/s" for start, kind, speed in rows]
        axes.set_yticks(range(len(rows)), [] if index == 1 else names)  # (b) has the rows of (a)
        axes.tick_params(labelsize="small")
        letter(axes, index, spec.symbol)
    return figure
