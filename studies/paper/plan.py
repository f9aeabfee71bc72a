"""The measurements of the paper: scenarios, ranges and numbers of seeds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from flockesc_env import FlockScenario, LineScenario
from flockesc_env.common.checks import as_count
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.scenario import AlignedHeadings, ConstantVelocity, Intercept, PurePursuit, approach
from flockesc_env.scenario.line import EscapeForce
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES
from flockesc_env.scenario.presets import as_scenario

CURVES, CONSENSUS = (f"studies.paper.jobs:{name}" for name in ("curves", "consensus"))
PAPER_OBJECTIVES: Final = (FLOCK_OBJECTIVES["min_mean_distance"], FLOCK_OBJECTIVES["min_min_distance"])

FLOCK: Final = FlockScenario()
LINE: Final = LineScenario()
FREE_LINE: Final = LineScenario(predator_position=None)

FORCES: Final[tuple[EscapeForce, ...]] = ("linear", "linear_as_printed", "constant")
LINE_GRID: Final = tuple(k / 100 for k in range(101))
COARSE: Final = slice(0, None, 10)  # the paper's grid 0, 0.1, .., 1 in LINE_GRID
BATCH: Final = 40  # trials of the paper's means
LEAST_FLOCKS: Final = 4  # with fewer, the halves that choose and measure a range have no interval

FREE_RANGES: Final = (0.0, 0.1, 0.2, 0.3, 1.0)
SHOWN_RANGES: Final = (1.0, 0.2, 0.1, 0.0)  # of Figures 3 and 4, in their order
THRESHOLD_RANGES: Final = (0.05, 0.1, 0.15, 0.2)  # at most rho_p, as Theorem 2 asks
PREDATOR_POSITIONS: Final = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)  # from the edge to the paper's place

FLOCK_GRID: Final = tuple(float(k) for k in range(101))
SHOWN_FLOCK_RANGES: Final = (0.0, 10.0, 100.0)
OFFSETS: Final = tuple(float(b) for b in range(0, 90, 10))  # m by which the predator misses the center
AIMED_GRID: Final = (0.0, 2.5, 5.0, 7.5, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 70.0, 100.0)

CONTROL_GRID: Final = (0.0, 5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0, 50.0, 100.0)
SHORT_RANGES: Final = (0.0, 10.0)  # nobody hears others; the paper's best range
STRENGTHS: Final = (0.0, 1.0, 10.0, 100.0)  # escape forces s of the control
NO_FORCE: Final = 0.0  # nobody flees
PAPER_FORCE: Final = 10.0
CAPTURE_RADIUS: Final = 5.0  # in m, where survival is measured

PAPER: Final = "paper"
SCENARIOS: Final[Mapping[str, FlockScenario]] = {
    PAPER: FLOCK,
    "pursuit": FLOCK.replace(predators=(PurePursuit(),)),
    "interception": FLOCK.replace(predators=(Intercept(),)),
    "aligned start": FLOCK.replace(initial_headings=AlignedHeadings((1.0, -1.0), math.pi / 2)),
    "head-on start": as_scenario("head-on", FlockScenario),
}
"""Flocks of the control: the paper's, other predators, and other starts. In the aligned start headings lie
within 90 degrees of a direction across the predator's path. In the head-on start all head toward it."""

SURVIVAL_SCENARIOS: Final = (PAPER, "pursuit", "interception")  # flocks in which survival is measured, too


@dataclass(frozen=True, kw_only=True)
class Trials:
    """How many initial states each mean is taken over."""

    flocks: int = 1_000
    lines: int = 4_000

    def __post_init__(self) -> None:
        as_count(self.flocks, "flocks", least=LEAST_FLOCKS)
        as_count(self.lines, "lines", least=BATCH)


def aimed(offset: float) -> FlockScenario:
    """Return the paper's flock with the predator's path shifted to its left by ``offset`` m."""
    return FLOCK.replace(predators=(ConstantVelocity(*approach(offset)),))


def control(scenario: str, strength: float, kind: str = "control") -> str:
    """Return the name of the measurement of a scenario under an escape force, "captures": with captures."""
    return f"{kind} {scenario} {strength:g}"


def measurements(trials: Trials) -> dict[str, list[Job]]:
    """Return the jobs of all measurements by name."""
    flocks, lines = range(trials.flocks), range(trials.lines)
    fearless = LINE.replace(repulsion_strength=NO_FORCE)
    blocked = FLOCK.replace(blocks_warnings=True)
    caught = {"capture_radius": CAPTURE_RADIUS}
    plan = {
        "free line": seed_jobs(CONSENSUS, FREE_LINE, FREE_RANGES, lines),
        "attacked line": seed_jobs(CONSENSUS, LINE, SHOWN_RANGES, lines),
        "fearless line": seed_jobs(OUTCOMES, fearless, LINE_GRID, lines),
        "curves": seed_jobs(CURVES, FLOCK, SHOWN_FLOCK_RANGES, flocks),
        "grid flock": seed_jobs(OUTCOMES, FLOCK, FLOCK_GRID, flocks),
        "literal flock": seed_jobs(OUTCOMES, FLOCK.replace(constant_speed=False), (10.0,), flocks),
        "blocked": seed_jobs(OUTCOMES, blocked, SHORT_RANGES, flocks),
        "blocked captures": seed_jobs(OUTCOMES, blocked.replace(**caught), SHORT_RANGES, flocks),
    }
    for force in FORCES:
        plan[f"grid {force}"] = seed_jobs(OUTCOMES, LINE.replace(escape_force=force), LINE_GRID, lines)
    for rho in THRESHOLD_RANGES:  # the line of Theorem 2 under exactly its strength s* = rho_p + rho
        line = LINE.replace(escape_force="constant", repulsion_strength=LINE.predator_range + rho)
        plan[f"threshold {rho}"] = seed_jobs(CONSENSUS, line, (rho,), lines)
    for place in PREDATOR_POSITIONS:
        line = LINE.replace(predator_position=place)
        plan[f"predator at {place}"] = seed_jobs(OUTCOMES, line, LINE_GRID, lines)
    for offset in OFFSETS:
        plan[f"aimed {offset:g}"] = seed_jobs(OUTCOMES, aimed(offset), AIMED_GRID, flocks)
    for name, scenario in SCENARIOS.items():
        for strength in STRENGTHS if name == PAPER else (NO_FORCE, PAPER_FORCE):
            flock = scenario.replace(repulsion_strength=strength)
            plan[control(name, strength)] = seed_jobs(OUTCOMES, flock, CONTROL_GRID, flocks)
            if name in SURVIVAL_SCENARIOS:
                flock = flock.replace(**caught)
                plan[control(name, strength, "captures")] = seed_jobs(OUTCOMES, flock, CONTROL_GRID, flocks)
    return plan
