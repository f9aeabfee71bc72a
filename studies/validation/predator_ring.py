"""Chen and Kolokolnikov 2014: the ring of prey around a predator, its radii and the limits of its stability.

Y. Chen and T. Kolokolnikov, "A minimal model of predator-swarm interactions", J. R. Soc. Interface 11 (2014)
20131208. The closed forms hold for infinitely many prey. With prey that repel each other by 1/d, attract each
other linearly with strength 1, and a predator of repulsion b that is attracted by c / d^(p - 1):

    R_1^2 = b,   R_2^2 = 1 + b,   stable for b R_2^(p - 2) < c < 1 / (R_1^(2 - p) - R_2^(2 - p)) if 2 < p < 4.

The limits are the zeros of the determinant and of the trace of the linear dynamics of the ring's center and
the predator.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import linregress

from flockesc_env import FlockScenario, simulate
from flockesc_env.common.stats import Estimate, FloatArray, half_width
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import Trajectory
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import Attracted, Disc, FirstOrder
from studies.measurements import share_of, split
from studies.style import letter
from studies.validation import Verdict
from training.figure_style import WIDTH

REPULSION: Final = 0.2  # b, in units of the repulsion between prey
EXPONENT: Final = 3.0  # p
INNER, OUTER = REPULSION**0.5, (1 + REPULSION) ** 0.5
CLOSED_FORMS: Final = {
    "inner radius": INNER,
    "outer radius": OUTER,
    "weakest predator": REPULSION * OUTER ** (EXPONENT - 2),
    "strongest predator": 1 / (INNER ** (2 - EXPONENT) - OUTER ** (2 - EXPONENT)),
}

SIZES: Final = {400: 4, 800: 4, 1_600: 2}  # by agents; in smaller ones higher orders than 1 / n matter
WEAK, STRONG = (0.2, 0.25), (0.7, 0.8)  # strengths c around the limits, between which zeros are interpolated
RELAXING: Final = 0.5  # predator strength with which the ring forms
TOLERANCE: Final = 0.005  # relative deviation of three digits
UNBOUNDED: Final = 1e6
STEP: Final = 0.01  # time step of the runs that measure stability
SHIFT: Final = 0.005  # of the predator from the center at first; with 0.02 the dynamics are not linear enough
FITTED: Final = (2.0, 9.0)  # times of the linear fit; changes of the density have decayed at the first
EVERY: Final = 5  # steps between two times of the fit


@dataclass(frozen=True)
class Limit:
    """One number: its closed form, the limit of many agents here, and means by ``SIZES``."""

    closed_form: float
    limit: Estimate
    means: tuple[float, ...]

    @property
    def deviation(self) -> float:
        """The relative deviation from the closed form."""
        return self.limit.mean / self.closed_form - 1


@dataclass(frozen=True)
class PredatorRing:
    """The numbers of ``CLOSED_FORMS``; number of flocks by the entries of ``SIZES``; a ring for the picture.

    ``ring`` has the positions of the agents relative to the predator, shape (n, 2).
    """

    limits: dict[str, Limit]
    num_flocks: tuple[int, ...]
    ring: list[list[float]]


def scenario(num_agents: int, strength: float, place: FloatArray, step: float, time: float) -> FlockScenario:
    """Return the published model with a predator at ``place``."""
    attraction = {"strength": strength, "exponent": EXPONENT, "max_speed": UNBOUNDED}
    predator = Attracted((float(place[0]), float(place[1])), (0.0, 0.0), **attraction)
    return FlockScenario(
        num_agents=num_agents,
        time_step=step,
        num_steps=round(time / step),
        initial_side=2.0,
        initial_positions=Disc(radius=1.0),
        speed=UNBOUNDED,
        constant_speed=False,
        motion=FirstOrder(repulsion=1.0, attraction=1.0),
        alignment_strength=0.0,
        repulsion_strength=REPULSION,
        predator_range=UNBOUNDED,
        predators=(predator,),
    )


def measure(num_agents: int, seeds: range) -> Arrays:
    """Return the numbers of ``CLOSED_FORMS`` by name, shape (seeds,), and rings, shape (n, seeds, 2)."""
    relaxing = scenario(num_agents, RELAXING, np.ones(2), step=0.05, time=100.0)
    runs = [simulate(relaxing, UNBOUNDED, seed=seed) for seed in seeds]
    offsets = np.stack([run.positions[-1] - run.predator_positions[-1] for run in runs])
    squares = (offsets**2).sum(axis=2)
    # The density is constant between the radii, so squared distances are uniform.
    center = squares.mean(axis=1)
    half = np.sqrt(3 * squares.var(axis=1))
    return {
        "inner radius": np.sqrt(center - half),
        "outer radius": np.sqrt(center + half),
        "weakest predator": np.array([_zero(run, "determinant", WEAK) for run in runs]),
        "strongest predator": np.array([_zero(run, "trace", STRONG) for run in runs]),
        "rings": offsets.swapaxes(0, 1),
    }


def _zero(ring: Trajectory, name: Literal["trace", "determinant"], strengths: tuple[float, float]) -> float:
    """Return the predator strength at which a number of ``_dynamics`` is 0, interpolated between two."""
    first, second = strengths
    low, high = (_dynamics(ring, strength)[name] for strength in strengths)
    return first - low * (second - first) / (high - low)


def _dynamics(ring: Trajectory, strength: float) -> dict[str, float]:
    """Return ``trace`` and ``determinant`` of the linear dynamics of the offset of predator and ring.

    ``ring`` is a run that ends with a ring at rest. The offset obeys y'' = trace y' - determinant y, in time
    units. Two runs with opposite shifts of the predator cancel even orders.
    """
    positions, predator = ring.positions[-1], ring.predator_positions[-1, 0]
    state: dict[str, Any] = {"initial_positions": positions, "initial_velocities": np.zeros_like(positions)}
    offsets = []
    for shift in (SHIFT, -SHIFT):
        place = predator + np.array([shift, 0.0])
        shifted = scenario(len(positions), strength, place, STEP, time=FITTED[1])
        run = simulate(shifted, UNBOUNDED, **state)
        offsets.append(run.positions.mean(axis=1)[:, 0] - run.predator_positions[:, 0, 0])
    # A linear system of two dimensions: y at a time is a combination of y at the two times before.
    y = (offsets[0] - offsets[1])[round(FITTED[0] / STEP) :: EVERY]
    recurrence = np.linalg.lstsq(np.stack([y[1:-1], y[:-2]], axis=1), y[2:])[0]
    roots = np.roots([1, *-recurrence]).astype(complex)
    # An explicit Euler step multiplies an eigenvector by 1 + step * eigenvalue.
    eigenvalues = (roots ** (1 / EVERY) - 1) / STEP
    return {"trace": float(eigenvalues.sum().real), "determinant": float(eigenvalues.prod().real)}


def jobs(scale: float) -> dict[int, list[Job]]:
    """Return the jobs by number of agents, for ``results``."""
    return {
        n: split(measure, n, flocks=share_of(HELD_OUT, count, scale), size=1, seconds=70 * (n / 800) ** 2)
        for n, count in SIZES.items()
    }


def results(measured: Mapping[int, Arrays]) -> PredatorRing:
    """Return the results of the jobs of ``jobs``."""
    return PredatorRing(
        limits={name: _limit(name, [measured[n][name] for n in SIZES]) for name in CLOSED_FORMS},
        num_flocks=tuple(len(measured[n]["inner radius"]) for n in SIZES),
        ring=measured[max(SIZES)]["rings"][:, 0].tolist(),
    )


def _limit(name: str, values: list[FloatArray]) -> Limit:
    """Return a number and its limit from values by ``SIZES``: the intercept of a regression against 1 / n."""
    inverse_sizes = np.repeat([1 / n for n in SIZES], [len(found) for found in values])
    fit = linregress(inverse_sizes, np.concatenate(values))
    half = half_width(fit.intercept_stderr**2, len(inverse_sizes) - 2)
    limit = Estimate(float(fit.intercept), float(fit.intercept - half), float(fit.intercept + half))
    return Limit(CLOSED_FORMS[name], limit, tuple(float(found.mean()) for found in values))


def verdict(results: PredatorRing) -> Verdict:
    """Return the verdict: all numbers must have three digits of the closed forms."""
    return Verdict.of(*(abs(limit.deviation) <= TOLERANCE for limit in results.limits.values()))


def figure(results: PredatorRing) -> Figure:
    """Draw a ring with the published radii, and every number against the number of agents."""
    figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    grid = figure.add_gridspec(2, 4)
    picture = figure.add_subplot(grid[:, :2])
    picture.plot(*np.array(results.ring).T, ".", color=LIGHT.ink, ms=2)
    picture.plot(0, 0, "o", color=LIGHT.predator, ms=6)
    angle = np.linspace(0, 2 * np.pi, 200)
    for radius in (INNER, OUTER):
        picture.plot(radius * np.cos(angle), radius * np.sin(angle), color=LIGHT.others[0], lw=1.5)
    picture.set_aspect("equal")
    picture.set_axis_off()
    letter(picture, 0, f"{len(results.ring)} agents and the published radii")
    for index, (name, limit) in enumerate(results.limits.items()):
        axes = figure.add_subplot(grid[index // 2, 2 + index % 2])
        axes.axhline(limit.closed_form, color=LIGHT.others[0], lw=1.5)
        axes.plot(tuple(SIZES), limit.means, ".-", color=LIGHT.ink)
        axes.set_xscale("log")
        axes.set_xticks(tuple(SIZES), [str(n) for n in SIZES])
        axes.minorticks_off()
        letter(axes, index + 1, name)
        if index >= 2:
            axes.set_xlabel("number of agents")
    return figure
