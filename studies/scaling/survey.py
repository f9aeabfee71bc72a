"""The study of scaling: its cells, the prediction that precedes most of them, figure and report."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import records
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import ConstantVelocity
from studies.measurements import Runner, means, share_of, split
from studies.robustness.survey import Choice, choose
from studies.scaling.flocks import approaches, attacks, objectives, turns
from studies.scaling.law import PAPER_SPEED, Ends, Law, duration, ends, fit, meetings
from studies.study import Results, Study, document, template
from studies.style import caption, curve, letter, subplots
from training.figure_style import RANGES as RANGE_COLORS

RANGES: Final = (0.0, 0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5, 2.0)  # in L
SPEEDS: Final = (0.5, 1.0, PAPER_SPEED, 2.0, 4.0)  # of the predator in v0
NOISES: Final = (0.0, 0.5, 1.0, 2.0)
PREDICTION_FILE: Final = "prediction.json"


@dataclass(frozen=True)
class Cell:
    """A flock, how many start (half choose the best range), and the predator's speeds in v0."""

    scenario: FlockScenario
    flocks: int
    speeds: tuple[float, ...]

    def jobs(self, scale: float) -> list[Job]:
        """Return the jobs of the attacks."""
        num_agents, flocks = self.scenario.num_agents, share_of(HELD_OUT, self.flocks, scale, least=4)
        seconds = self.scenario.num_steps * num_agents * len(RANGES) * 1e-7
        arguments, size = (self.scenario, RANGES, self.speeds), max(1, 15_000 // num_agents)
        return split(attacks, *arguments, flocks=flocks, size=size, seconds=seconds)


def cell(
    num_agents: int,
    flocks: int,
    *speeds: float,
    side: float = 100.0,
    dimension: int = 2,
    fled: float | None = None,
    **fields: Any,
) -> Cell:
    """Return a variant of the paper's flock that flees up to ``fled`` m; None: that has no escape force."""
    start, velocity = ((length,) * dimension for length in (-0.3 * side, 10.0))
    chosen = speeds or (math.sqrt(dimension),)
    time = duration(dimension, min(chosen)) * side / 10
    scenario = FlockScenario().replace(
        num_agents=num_agents,
        dimension=dimension,
        num_steps=round(time / 0.05),
        initial_side=side,
        repulsion_strength=10.0 if fled else 0.0,
        predator_range=fled or 30.0,
        predators=(ConstantVelocity(start, velocity),),
        **fields,
    )
    return Cell(scenario, flocks, chosen)


FITTED: Final = {f"{n} agents": cell(n, flocks) for n, flocks in ((75, 1200), (300, 800), (1200, 300))}
CELLS: Final = {
    "4800 agents": cell(4800, 42),
    **{f"noise {noise:g}": cell(300, 100, *SPEEDS, angular_noise=noise) for noise in NOISES},
    **{f"turning length {10 * m:g} m": cell(300, 150, mass=m) for m in (0.025, 0.4, 1.6)},
    "75 agents, L = 50 m": cell(75, 600, side=50.0),
    "1200 agents, L = 200 m": cell(1200, 48, side=200.0),
    "75 agents, rho_p = 0.3 L": cell(75, 600, fled=30.0),
    "300 agents, rho_p = 0.3 L": cell(300, 600, fled=30.0),
    "1200 agents, rho_p = 0.3 L": cell(1200, 96, fled=30.0),
    "75 agents, L = 50 m, rho_p = 0.3 L": cell(75, 600, side=50.0, fled=15.0),
    "75 agents, L = 50 m, rho_p = 30 m": cell(75, 600, side=50.0, fled=30.0),
    "1200 agents, L = 200 m, rho_p = 0.3 L": cell(1200, 48, side=200.0, fled=60.0),
    "1200 agents, L = 200 m, rho_p = 30 m": cell(1200, 48, side=200.0, fled=30.0),
    "300 agents in space": cell(300, 150, dimension=3),
    "1200 agents in space": cell(1200, 48, dimension=3),
}
"""Cells that are not fitted. Flocks of 75, 300 and 1200 agents in 50, 100 and 200 m have equal densities."""

PREDICTED: Final = (("4800 agents", PAPER_SPEED), ("noise 0", 2.0), ("noise 1", PAPER_SPEED))
"""Cells and speeds whose prediction was stored before they ran."""

STILL: Final = FlockScenario(repulsion_strength=0.0, predators=(), num_steps=480)
CONTROLS: Final = {
    "flock": STILL,
    "without the edge": STILL.replace(periodic_side=STILL.initial_side),
    "frozen graph": STILL.replace(frozen_graph=True),
    "flock in space": STILL.replace(dimension=3),
    "in space without the edge": STILL.replace(dimension=3, periodic_side=STILL.initial_side),
}
CONTROL_RANGES: Final = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3)  # in L
CONTROL_FLOCKS: Final = 40
OBJECTIVE_RANGES: Final = (0.0, 5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0, 60.0, 150.0)  # in m
OBJECTIVE_FLOCKS: Final = 200


@dataclass(frozen=True)
class Curve:
    """Gains in J_mean over range 0 in L, one per range of ``RANGES``, of a cell under a predator's speed.

    ``first`` is measured on the flocks that choose the best range, everything else on the other half.
    """

    name: str
    speed: float
    first: tuple[Estimate, ...]
    second: tuple[Estimate, ...]
    at_zero: Estimate
    choice: Choice
    components: tuple[float, ...]
    ends: Ends
    law: tuple[float, ...]

    def error(self) -> tuple[float, float]:
        """Return the rms of the law's errors and of the standard errors over the ranges, in L."""
        errors = [one.mean - value for one, value in zip(self.second[1:], self.law[1:], strict=True)]
        widths = [(one.high - one.low) / 3.92 for one in self.second[1:]]
        return float(np.sqrt(np.mean(np.square(errors)))), float(np.sqrt(np.mean(np.square(widths))))


@dataclass(frozen=True)
class Scaling(Results):
    """All results: the law, curves, estimates of ``turns`` by control, and best ranges by objective.

    ``gains`` are those in J_mean over range 0, paired, in L, by control and approach.
    """

    law: Law
    curves: tuple[Curve, ...]
    controls: dict[str, dict[str, tuple[Estimate, ...]]]
    gains: dict[str, dict[str, tuple[Estimate, ...]]]
    objectives: dict[str, Choice]
    versions: dict[str, str]

    def curve(self, name: str, speed: float = PAPER_SPEED) -> Curve:
        """Return the curve of a cell."""
        return next(one for one in self.curves if (one.name, one.speed) == (name, speed))


def gains(law: Law, one: Cell, speed: float) -> tuple[float, ...]:
    """Return the law's gains in L over range 0, one per range."""
    flock = one.scenario
    found = ends(flock.dimension, speed, flock.angular_noise)
    return tuple(law.gain(flock.num_agents, np.array(RANGES), found, flock.dimension).tolist())


def predict(runner: Runner, output: Path, scale: float) -> tuple[Law, dict[str, Arrays]]:
    """Measure ``FITTED``, fit the law to the flocks that choose, and store its gains in ``PREDICTED``."""
    measured = runner.run({name: one.jobs(scale) for name, one in FITTED.items()}, "Fitted cells")
    chosen_on = []
    for name, one in FITTED.items():
        reached = measured[name]["reached"][:, :, 0]
        chosen_on.append((one.scenario.num_agents, _gains(reached[:, : reached.shape[1] // 2])))
    law = fit(np.array(RANGES), chosen_on)
    predicted = {f"{name}, {speed:.2f} v0": gains(law, CELLS[name], speed) for name, speed in PREDICTED}
    write_text(output / PREDICTION_FILE, document({"law": law, "gains": predicted}))
    return law, measured


def _gains(reached: FloatArray) -> tuple[Estimate, ...]:
    """Return gains over the first range, paired, from values of shape (ranges, flocks)."""
    return means(reached - reached[0])


def measure(runner: Runner, output: Path, scale: float) -> Scaling:
    """Fit and predict, then measure the other cells, the controls and the objectives."""
    law, measured = predict(runner, output, scale)
    measured |= runner.run({name: one.jobs(scale) for name, one in CELLS.items()}, "Other cells")
    curves = []
    for name, one in (FITTED | CELLS).items():
        for at, speed in enumerate(one.speeds):
            reached, components = measured[name]["reached"][:, :, at], measured[name]["components"]
            half = reached.shape[1] // 2
            curves.append(
                Curve(
                    name=name,
                    speed=speed,
                    first=_gains(reached[:, :half]),
                    second=_gains(reached[:, half:]),
                    at_zero=mean(reached[0, half:]),
                    choice=choose(RANGES, reached),
                    components=tuple(components[:, half:].mean(axis=1).tolist()),
                    ends=ends(one.scenario.dimension, speed, one.scenario.angular_noise),
                    law=gains(law, one, speed),
                )
            )
    flocks = share_of(HELD_OUT, CONTROL_FLOCKS, scale, least=4)
    jobs = {
        name: split(turns, still, CONTROL_RANGES, flocks=flocks, size=5, seconds=0.5)
        for name, still in CONTROLS.items()
    }
    controls = runner.run(jobs, "Controls")
    flocks = share_of(HELD_OUT, OBJECTIVE_FLOCKS, scale, least=4)
    played = split(objectives, FlockScenario(), OBJECTIVE_RANGES, flocks=flocks, size=10, seconds=0.2)
    values = runner.join(played, "Objectives")
    return Scaling(
        law=law,
        curves=tuple(curves),
        controls={
            name: {kind: means(rows) for kind, rows in found.items()} for name, found in controls.items()
        },
        gains={
            name: {way: _gains(found[way]) for way in approaches(CONTROLS[name].dimension)}
            for name, found in controls.items()
        },
        objectives={name: choose(OBJECTIVE_RANGES, rows) for name, rows in values.items()},
        versions=records.versions("scipy"),
    )


def figure(results: Scaling) -> Figure:
    """Draw the gains against the range and, below 0.1 L, against the agents met, beside the law."""
    figure, (left, right) = subplots(3.9, 1, 2, sharey=True)
    shown = [*FITTED, "4800 agents"]
    for name, color in zip(shown, (*LIGHT.others[:3], LIGHT.others[4]), strict=True):
        one, num_agents = results.curve(name), (FITTED | CELLS)[name].scenario.num_agents
        rows = [Estimate(*(100 * part for part in vars(gain).values())) for gain in one.second]
        met = meetings(num_agents, np.array(RANGES), one.ends.time).tolist()
        short = sum(rho <= 0.1 for rho in RANGES)
        for axes, at, count in ((left, RANGES, len(RANGES)), (right, met, short)):
            curve(axes, at[1:count], rows[1:count], color, "o-", band=0.15, lw=1.4, ms=3)
            axes.plot(at[1:count], 100 * np.array(one.law[1:count]), "--", color=color, lw=1)
        left.plot([], [], color=color, label=name)
    left.axhline(100 * (one.ends.aligned - one.ends.alone), color=LIGHT.muted, lw=0.8)
    for axes in (left, right):
        axes.axhline(0, color=LIGHT.ink, lw=0.8)
        axes.set_xscale("log")
    left.set(xlabel="interaction range / L", ylabel="gain in J_mean over range 0 (% of L)")
    right.set_xlabel("agents met under this range, up to 0.1 L")
    left.legend(loc="lower left")
    letter(left, 0, "one curve on the range / L, from 0.04 L on")
    letter(right, 1, "one curve on the agents met, below")
    caption(
        figure,
        "Flocks without an escape force; bands: 95 % intervals; dashed: the law; gray: all along one heading",
    )
    return figure


def speed_noise_map(results: Scaling) -> Figure:
    """Draw the best range and its gain over range 0 as colors, over the predator's speed and the noise."""
    figure, panels = subplots(3.2, 1, 2, sharey=True)
    cells = [[results.curve(f"noise {noise:g}", speed) for speed in SPEEDS] for noise in NOISES]
    found = {
        "best range / L": ([[one.choice.best.mean for one in row] for row in cells], "{:.2f}"),
        "gain over range 0 there (% of L)": (
            [[100 * one.choice.gain_over_zero.mean for one in row] for row in cells],
            "{:+.1f}",
        ),
    }
    for index, (axes, (title, (values, digits))) in enumerate(zip(panels, found.items(), strict=True)):
        axes.imshow(values, cmap=RANGE_COLORS, aspect="auto", origin="lower", vmin=0)
        middle = np.max(values) / 2
        for (row, column), value in np.ndenumerate(values):
            color = LIGHT.page if value < middle else LIGHT.ink
            axes.text(column, row, digits.format(value), ha="center", va="center", color=color)
        axes.set_xticks(range(len(SPEEDS)), [f"{speed:.3g}" for speed in SPEEDS])
        axes.set_yticks(range(len(NOISES)), [f"{noise:g}" for noise in NOISES])
        axes.set_xlabel("speed of the predator (v0)")
        letter(axes, index, title)
    panels[0].set_ylabel("angular noise (rad per step)")
    return figure


def report(results: Scaling) -> str:
    """Return the report as Markdown."""
    return template("scaling/templates/scaling.md", globals()).render(results=results)


SCALING = Study(
    measure=measure,
    load=Scaling.load,
    figures=lambda results: {"collapse": figure(results), "map": speed_noise_map(results)},
    report=report,
)
