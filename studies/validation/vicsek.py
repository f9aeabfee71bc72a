"""Vicsek et al. 1995: order against angular noise at constant density, for 40 to 10,000 agents.

Vicsek, Czirok, Ben-Jacob, Cohen and Shochet, "Novel type of phase transition in a system of self-driven
particles" (1995), Figure 2a.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, scan
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import AlignedHeadings, RandomHeadings, Vicsek
from studies.measurements import means, share_of, split
from studies.style import curve, letter, subplots
from studies.validation import Verdict
from training.figure_style import label_ends

DENSITY: Final = 4.0  # agents per square of the interaction range
SIZES: Final = dict.fromkeys((40, 100, 400, 4_000, 10_000), 10)
"""Flocks by their number of agents; ``CONTROL`` is one of them."""

NOISES: Final = (0.0, 1.0, 2.0, 3.0, 3.5, 4.0, 4.5, 5.0, 2 * np.pi)
"""Widths eta of the angular noise in rad; under the last one headings are independent."""

ORDERED, DISORDERED = 3.0, 5.0  # noises between which order falls, in rad
NUM_STEPS: Final = 1_000
SKIP: Final = 500
CONTROL: Final = 400  # agents of the flocks that also start with random headings, as in 1995
TOLERANCE: Final = 0.1  # largest relative deviation from the exact order of independent headings


@dataclass(frozen=True)
class OrderAgainstNoise:
    """Time means of the polarization by ``SIZES`` and ``NOISES``.

    ``falls`` is the order at ``DISORDERED`` noise over that at ``ORDERED`` noise, and ``independent`` the
    order at the largest noise over its exact value, by ``SIZES``. ``from_random`` is the order of flocks that
    start with random headings minus that of the aligned ones, by ``NOISES``.
    """

    order: tuple[tuple[Estimate, ...], ...]
    falls: tuple[Estimate, ...]
    independent: tuple[Estimate, ...]
    from_random: tuple[Estimate, ...]
    num_flocks: tuple[int, ...]

    @property
    def largest_change(self) -> Estimate:
        """The largest difference that the start makes."""
        return max(self.from_random, key=lambda change: abs(change.mean))


def periodic_flock(num_agents: int, **fields: Any) -> FlockScenario:
    """Return the Vicsek model with time step 1 and interaction range 1, which starts aligned."""
    side, aligned = (num_agents / DENSITY) ** 0.5, AlignedHeadings((1.0, 0.0), 0.0)
    fields = {"initial_headings": aligned, "initial_side": side, "periodic_side": side, **fields}
    return FlockScenario(num_agents=num_agents, time_step=1.0, motion=Vicsek(), predators=(), **fields)


def mean_order(scenario: FlockScenario, noises: Sequence[float], skip: int, seeds: range) -> Arrays:
    """Return time means of the polarization, shape (noises, seeds)."""
    return {"mean": scan(scenario, {"angular_noise": noises}, 1.0, seeds, skip=skip).means()}


def jobs(scale: float) -> dict[str, list[Job]]:
    """Return the jobs by flock, for ``results``."""
    fields: dict[str, Any] = {"speed": 0.03, "num_steps": NUM_STEPS}
    flocks = {str(size): periodic_flock(size, **fields) for size in SIZES}
    flocks["random"] = periodic_flock(CONTROL, **fields, initial_headings=RandomHeadings())
    return {
        name: split(
            mean_order,
            *(flock, NOISES, SKIP),
            flocks=share_of(HELD_OUT, SIZES[flock.num_agents], scale, least=4),
            size=1,
            seconds=5e-3 * flock.num_agents,
        )
        for name, flock in flocks.items()
    }


def results(measured: Mapping[str, Arrays]) -> OrderAgainstNoise:
    """Return the results of the jobs of ``jobs``."""
    values: dict[str, FloatArray] = {name: found["mean"] for name, found in measured.items()}
    ordered, disordered = NOISES.index(ORDERED), NOISES.index(DISORDERED)
    by_size = [values[str(size)] for size in SIZES]
    return OrderAgainstNoise(
        order=tuple(means(found) for found in by_size),
        falls=means(found[disordered] / found[ordered] for found in by_size),
        independent=means(found[-1] / exact(size) for size, found in zip(SIZES, by_size, strict=True)),
        from_random=means(values["random"] - values[str(CONTROL)]),
        num_flocks=tuple(found.shape[1] for found in by_size),
    )


def exact(num_agents: int) -> float:
    """Return the mean polarization of independent headings, sqrt(pi / n) / 2 for many agents."""
    return float(np.sqrt(np.pi / num_agents) / 2)


def verdict(results: OrderAgainstNoise) -> Verdict:
    """Return the verdict by the rule on the page."""
    falls = all(after.high < before.low for row in results.order for before, after in pairwise(row))
    is_sharper = results.falls[-1].high < results.falls[0].low
    are_independent = all(abs(end - 1) < TOLERANCE for e in results.independent for end in (e.low, e.high))
    return Verdict.of(falls, is_sharper, are_independent)


def figure(results: OrderAgainstNoise) -> Figure:
    """Draw order against noise by size, and the order of independent headings with its exact value."""
    figure, (left, right) = subplots(3.4, 1, 2)
    ends = []
    for color, size, row in zip(LIGHT.ranges, SIZES, results.order, strict=False):
        curve(left, NOISES, row, color, "o-", band=0.25, lw=1.5, ms=3)
        ends.append((row[-1].mean, f"{size:,} agents", color))
    left.set(xlabel="angular noise (rad)", ylabel="polarization", ylim=(0, 1))
    label_ends(left, ends)
    sizes = tuple(SIZES)
    curve(right, sizes, [row[-1] for row in results.order], LIGHT.ink, "o", band=0.0, ms=4)
    right.plot(sizes, [exact(size) for size in sizes], color=LIGHT.accent, lw=1.2, zorder=0)
    right.annotate("exact", (1_000, exact(1_000)), (5, 5), textcoords="offset points", color=LIGHT.accent)
    right.set(xscale="log", yscale="log", xlabel="number of agents", ylabel="polarization")
    letter(left, 0, "order against noise")
    letter(right, 1, "independent headings (noise 2 pi)")
    return figure
