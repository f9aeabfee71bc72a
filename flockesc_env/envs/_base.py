"""Base classes of the environments: constructor, rendering, snapshots, read access to the state.

An environment of flocks is a subclass of ``OneFlock`` or ``ManyFlocks``. Each holds one ``FlockBatch`` and
can be copied (``copy.deepcopy``) and pickled at any time.
"""

from __future__ import annotations

from abc import abstractmethod
from copy import deepcopy
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from flockesc_env.episodes.batch import FlockBatch, Observations
from flockesc_env.episodes.options import (
    EnvOptions,
    EnvOptionsDict,
    LineOptionsDict,
    check_names,
    env_options,
)
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.episodes.views import FlockView
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second, render
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer, Viewer

Seen = TypeVar("Seen")
"""What ``reset`` returns first."""


class RenderArguments(TypedDict, total=False):
    """Keyword arguments of every environment.

    Attributes:
        render_mode: ``"rgb_array"``: ``render`` returns a picture; ``"human"``: a window shows every reset
            and step; ``None``: no pictures.
        render_options: what pictures show.
    """

    render_mode: str | None
    render_options: RenderOptions | None


class CommonArguments(RenderArguments, EnvOptionsDict, total=False):
    """Keyword arguments of every environment of flocks, with those of ``EnvOptions`` and ``RenderArguments``.

    Attributes:
        num_threads: threads that share the flocks, or a single large flock; ``None``: one per core.
    """

    num_threads: int | None


class FlockArguments(CommonArguments, total=False):
    """``CommonArguments``, and the policy of the predators.

    Attributes:
        predator_policy: controls the ``Learned`` predators, for example ``Pursue()`` or a trained
            ``SB3Policy``. ``None``: they fly straight on, or act in ``step`` if they are agents.
    """

    predator_policy: PredatorPolicy | None


class LineArguments(RenderArguments, LineOptionsDict, total=False):
    """Keyword arguments of the line's environment, with those of ``LineOptions`` and ``RenderArguments``."""


class Viewed:
    """An environment that may have a viewer."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}
    render_mode: str | None = None
    _viewer: Viewer | None = None  # Gymnasium calls `close` even if the constructor failed

    def _set_frames_per_second(self, fps: int) -> None:
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}


class Rendered(Viewed):
    """An environment with one picture."""

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (size, size, 3), or show it in mode ``"human"``.

        Raises:
            ResetNeededError: before ``reset``.
        """
        pictures = render(self._viewer)
        return pictures[0] if pictures else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()


class FlockEnvironment(Viewed):
    """An environment over one batch of flocks.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        arguments: see ``FlockArguments``.
        num_flocks: number of flocks.
        per_agent: whether every agent has its own range and observation, or every flock one.

    Attributes:
        scenario: the scenario of all flocks.
        options: what actions set, what is rewarded, what is observed.

    Raises:
        ArgumentError: for an argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
        ScenarioError: for a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    _arguments: ClassVar[type] = FlockArguments
    _viewer: FlockViewer | None = None

    def __init__(
        self,
        scenario: FlockScenario | str | None,
        arguments: CommonArguments,
        *,
        num_flocks: int = 1,
        per_agent: bool = False,
    ) -> None:
        given = as_scenario(scenario, FlockScenario)
        check_names(arguments, self._arguments.__annotations__, FlockScenario)
        options = {name: value for name, value in arguments.items() if name in EnvOptionsDict.__annotations__}
        self._batch = batch = FlockBatch(
            given,
            env_options(given, cast("EnvOptionsDict", options)),
            num_flocks=num_flocks,
            per_agent=per_agent,
            num_threads=arguments.get("num_threads"),
            predator_policy=cast("FlockArguments", arguments).get("predator_policy"),
        )
        self.scenario: FlockScenario = batch.scenario
        self.options: EnvOptions = batch.options
        fps = frames_per_second(given.time_step * self.options.steps_per_action)
        self.render_mode = arguments.get("render_mode")
        self._viewer = flock_viewer(batch, self.render_mode, arguments.get("render_options"), fps)
        self._set_frames_per_second(fps)

    def _show(self) -> None:
        """Hand the state to the viewer, after a reset or a step."""
        if self._viewer is not None:
            self._viewer.update()

    def _restore(self, state: Any, flocks: Any = None) -> None:
        slots = self._batch.set_state(state, flocks)
        if self._viewer is not None:
            self._viewer.forget(slots)
            self._viewer.update()


class OneFlock(FlockEnvironment, Rendered, Generic[Seen]):
    """An environment with one flock."""

    @property
    def flock(self) -> FlockView:
        """Read-only access to the state of the flock."""
        return FlockView(self._batch)

    def get_state(self) -> bytes:
        """Return a snapshot of the episode and of the seeds of later episodes, as bytes.

        Every environment of the same scenario, options and interface can restore it, in every process and
        with any number of threads. It names its format version and has a checksum. It does not contain
        ``np_random`` and the random states of spaces; no episode draws from them.

        Raises:
            ResetNeededError: before ``reset``.
        """
        return self._batch.get_state()

    def set_state(self, state: bytes) -> Seen:
        """Restore a snapshot and return the observation at that moment.

        Args:
            state: what ``get_state`` returned, here or in another environment.

        Raises:
            ArgumentError: for a snapshot that is damaged or belongs to another version, scenario, interface
                or other options; the running episode goes on.
        """
        self._restore(state)
        return self._observe()

    @abstractmethod
    def _observe(self) -> Seen:
        """Return the current observation, after updating what depends on the state."""


class ManyFlocks(FlockEnvironment):
    """An environment with many flocks, whose snapshots hold all flocks or some."""

    @property
    def flocks(self) -> list[FlockView]:
        """Read-only access to the state of each flock."""
        return [FlockView(self._batch, slot) for slot in range(self._batch.num_flocks)]

    def get_state(self, flocks: Any = None) -> bytes:
        """Return a snapshot of some flocks as bytes; see ``FlockEscapeEnv.get_state``.

        Args:
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds.
            ResetNeededError: before ``reset``.
        """
        return self._batch.get_state(flocks)

    def set_state(self, state: bytes, flocks: Any = None) -> Observations:
        """Restore flocks from a snapshot and return the observations of all flocks.

        Args:
            state: what ``get_state`` returned for as many flocks, or for one, such as that of a single
                environment, which is copied to all ``flocks``.
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds, or a snapshot that is damaged or belongs to another
                version, scenario, interface, number of flocks or other options; the running episodes go on.
            ResetNeededError: before ``reset``, if ``flocks`` leaves some out.
        """
        self._restore(state, flocks)
        return self._batch.observe(range(self._batch.num_flocks))
