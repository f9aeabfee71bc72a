"""``Flock``: one flock that a script steps, changes, pushes, saves and continues."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_bytes, as_count, as_floats, as_threads
from flockesc_env.common.errors import InputError, shown
from flockesc_env.models.simulate import IntArray, optional_floats, seed_or_fresh
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


def _entry(name: str, *, can_be_set: bool = False) -> Any:
    """Return a property for an entry of the state."""

    def assign(flock: Flock, values: ArrayLike) -> None:
        flock._check_idle()
        flock._core.set(name, as_floats(values, name, flock._shape))

    return property(lambda flock: flock._core.get(name), assign if can_be_set else None)


class Flock:
    """A flock at one time, which ``step`` advances without end; ``scenario.num_steps`` has no effect.

    The steps are those of ``simulate``, bit for bit. Properties return new arrays, in the order of agents.

    Args:
        scenario: the model's parameters, or a preset's name; periodic and without predators, too.
        seed: seed as in ``simulate``; ``None``: a random seed from the operating system.
        positions: r(0) in m, shape (n, D); ``None``: drawn from the seed.
        velocities: v(0) in m/s, shape (n, D), of the agents' speeds if the scenario has constant speed;
            ``None``: drawn from the seed.
        num_threads: number of threads for a large flock; ``None``: one per core.
        extra_force: a function of this flock that returns forces, shape (n, D), in the units of f_i. ``step``
            calls it before each step and adds them to f_i. It may read the flock, but not change it.

    Examples:
        >>> flock = Flock("paper-flock", seed=7)
        >>> flock.step(10.0, 100)
        >>> flock.time, round(float(flock.distances.mean()), 2)
        (5.0, 78.27)
    """

    positions: FloatArray = _entry("positions", can_be_set=True)
    """Positions in m, shape (n, D). They can be set; those of caught agents stay."""
    velocities: FloatArray = _entry("velocities", can_be_set=True)
    """Velocities in m/s, shape (n, D). They can be set; those of caught agents stay."""
    predator_positions: FloatArray = _entry("predator_positions")
    """Positions of the P predators in m, shape (P, D)."""
    predator_velocities: FloatArray = _entry("predator_velocities")
    """Velocities of the P predators in m/s, shape (P, D)."""
    distances: FloatArray = _entry("distances")
    """Distance of every agent to the nearest predator in m, shape (n,); 0 for caught agents."""
    caught_by: IntArray = _entry("caught_by")
    """Index of the predator that caught each agent, the nearest one, or -1; shape (n,)."""
    heard: IntArray = _entry("heard")
    """Number of other agents that each agent heard in the last step, shape (n,); at the start 0."""

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        seed: int | None = None,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        num_threads: int | None = None,
        extra_force: Callable[[Flock], ArrayLike] | None = None,
    ) -> None:
        if extra_force is not None and not callable(extra_force):
            raise InputError("extra_force", "a function or None", shown(extra_force))
        self._given = as_scenario(scenario, FlockScenario)
        self._shape = (self._given.num_agents, self._given.dimension)
        self._extra_force, self._is_in_force = extra_force, False
        start = optional_floats(positions, "positions", self._shape)
        moves = optional_floats(velocities, "velocities", self._shape)
        document, threads = self._given.to_json(), as_threads(num_threads)
        self._core = _core.Flock(document, seed_or_fresh(seed), start, moves, threads)
        if velocities is not None:
            self.velocities = self.velocities  # checks their speeds

    def step(
        self, ranges: ArrayLike, num_steps: int = 1, *, predator_actions: ArrayLike | None = None
    ) -> None:
        """Advance the flock.

        Args:
            ranges: rho in m, a scalar or one per agent, shape (n,).
            num_steps: number of steps.
            predator_actions: actions in [-1, 1] of the L ``Learned`` predators, shape (L, D); ``None``: they
                fly straight on.

        A bad force raises ``InputError``: the step in which it occurs is not made.
        """
        self._check_idle()
        rho, count = as_floats(ranges, "ranges", least=0.0), as_count(num_steps, "num_steps")
        if rho.shape not in {(), self._shape[:1]}:
            raise InputError("ranges", f"a scalar or shape ({self._shape[0]},)", f"shape {rho.shape}")
        actions_shape = (self._given.num_learned, self._shape[1])
        actions = optional_floats(predator_actions, "predator_actions", actions_shape)
        if self._extra_force is None:
            self._core.step(rho, count, actions, None)
            return
        for _ in range(count):
            self._is_in_force = True
            try:
                force = as_floats(self._extra_force(self), "extra_force", self._shape)
            finally:
                self._is_in_force = False
            self._core.step(rho, 1, actions, force)

    @property
    def scenario(self) -> FlockScenario:
        """The model's parameters; randomized fields have their drawn values."""
        return self._given.drawn(int(self._core.get("seed")))

    @property
    def time(self) -> float:
        """Time in s since the start."""
        return int(self._core.get("num_steps")) * self._given.time_step

    @property
    def caught(self) -> NDArray[np.bool]:
        """Whether each agent has been caught, shape (n,)."""
        return self.caught_by >= 0

    def get_state(self) -> bytes:
        """Return a snapshot, without ``extra_force``, from which any flock of this scenario continues."""
        return self._core.get_state()

    def set_state(self, state: bytes) -> None:
        """Restore a snapshot; one that is damaged or of another scenario raises ``InputError``."""
        self._check_idle()
        self._core.set_state(as_bytes(state, "state"))

    def copy(self) -> Flock:
        """Return an independent copy, with the same ``extra_force``."""
        twin = object.__new__(Flock)
        vars(twin).update(vars(self), _core=self._core.copy(), _is_in_force=False)
        return twin

    __copy__ = copy

    def _check_idle(self) -> None:
        if self._is_in_force:
            raise InputError("extra_force", "a function that does not change the flock", "one that does")
