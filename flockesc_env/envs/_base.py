"""Base classes of the environments: constructor, rendering, snapshots, access to the state.

An environment of flocks is a subclass of ``OneFlock`` or ``ManyFlocks``. Each holds one ``FlockBatch`` and
can be copied (``copy.deepcopy``) and pickled at any time.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy, deepcopy
from functools import wraps
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast

from gymnasium import logger
from gymnasium.envs.registration import EnvSpec

from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.batch import FlockBatch, Observations
from flockesc_env.episodes.current_state import FlockView
from flockesc_env.episodes.options import EnvOptions, EnvOptionsDict, LineOptionsDict, View, options_in
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.episodes.starts import Scenarios, as_scenarios
from flockesc_env.render import RenderOptions
from flockesc_env.render.frames import live_frames
from flockesc_env.render.viewer import RENDER_MODES, Image, Viewer, as_viewer
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

Method = TypeVar("Method", bound=Callable[..., Any])

ObsType = TypeVar("ObsType")
"""Type of the observations that ``reset`` returns."""


class FlockArguments(EnvOptionsDict, total=False):
    """Keyword arguments of all flock environments: ``EnvOptions`` and the following.

    Attributes:
        render_mode: ``"rgb_array"``: ``render`` returns an image; ``"human"``: a window shows every reset
            and step; ``None``: no rendering.
        render_options: what the images show; ``None``: the defaults of ``RenderOptions``.
        num_threads: number of threads for many flocks or one large flock; ``None``: one per core. Results do
            not depend on it.
        predator_policy: controls the ``Learned`` predators, for example ``Pursue()`` or a trained
            ``SB3Policy``. ``None``: they fly straight on, or act in ``step`` if they are agents.
    """

    render_mode: str | None
    render_options: RenderOptions | None
    num_threads: int | None
    predator_policy: PredatorPolicy | None


class LineArguments(LineOptionsDict, total=False):
    """Keyword arguments of the line environment: ``LineOptions``, and rendering as in ``FlockArguments``."""

    render_mode: str | None
    render_options: RenderOptions | None


Infos = Literal["all", "end"]
"""Which ``info`` dicts of ``step`` have entries: all, or those of agents or slots whose episode has ended."""


def survives_interrupts(method: Method) -> Method:
    """Keep the episodes of an environment after Ctrl-C during a method, or drop them if the core lost one.

    Every method that changes an episode has this decorator. Without it, an interrupt could separate the
    state of the batch from what Python keeps beside it: agents' names, policies' memories, pictures.
    """

    @wraps(method)
    def call(self: Viewed, *args: Any, **kwargs: Any) -> Any:
        try:
            return method(self, *args, **kwargs)
        except KeyboardInterrupt:
            try:
                self._settle()
            except BaseException:  # the core has no episode, or a second Ctrl-C
                self._drop_episodes()
            raise

    return cast("Method", call)


class Viewed:
    """Base class of all environments: render mode and viewer. A complete environment keeps its settings."""

    _arguments: ClassVar[type]
    _is_complete = False
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}
    render_mode: str | None = None
    _viewer: Viewer | None = None  # Gymnasium calls `close` even if the constructor failed

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make the constructor set ``_is_complete`` at its end, unless a subclass's constructor called it."""
        super().__init_subclass__(**kwargs)
        if "__init__" in vars(cls):
            init: Any = cls.__init__

            @wraps(init)
            def call(self: Viewed, *args: Any, **kwargs: Any) -> None:
                init(self, *args, **kwargs)
                self._is_complete = type(self).__init__ is call

            cls.__init__ = call  # type: ignore[assignment]

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; after the constructor, settings raise ``InputError``."""
        if self._is_complete and self._is_setting(name):
            way = "create a new environment" + ("" if name in _DERIVED else f" with {name}=..")
            raise InputError(name, f"no assignment after creation ({way})", shown(value))
        super().__setattr__(name, value)

    def _is_setting(self, name: str) -> bool:
        return name in _SETTINGS or name in _DERIVED or name in self._arguments.__annotations__

    def close(self) -> None:
        """Close the window if one is open."""
        if self._viewer is not None:
            self._viewer.close()

    def render(self) -> Any:
        """Return an image, shape (size, size, 3); in mode ``"human"`` show it and return ``None``."""
        images = self._images()
        return images[0] if images else None

    def _images(self) -> list[Image] | None:
        """Return a picture of every flock or, in mode ``"human"``, show them; without a mode, warn."""
        if self._viewer is not None:
            return self._viewer.render()
        advice = 'pass render_mode="rgb_array" or "human" to the constructor'
        logger.warn(f"render: no render mode was chosen; {advice}")
        return None

    @abstractmethod
    def _settle(self) -> None:
        """Make what Python keeps fit the episodes of the core, after an interrupt."""

    @abstractmethod
    def _drop_episodes(self) -> None:
        """Require a reset, after an interrupt."""

    @abstractmethod
    def _num_actions(self) -> int:
        """Return the number of actions of an episode that does not end early."""

    def _prepare_rendering(self, arguments: Mapping[str, Any], fps: int, **flocks: int) -> None:
        self.render_mode = arguments.get("render_mode")
        self._viewer = as_viewer(self.render_mode, arguments.get("render_options"), fps, **flocks)
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}


_SETTINGS = {"autoreset_mode", "copy", "max_episode_steps", "num_envs", "num_flocks", "per_agent", "scenario"}
"""Arguments of constructors that are not in a ``TypedDict``."""

_DERIVED = {
    *("options", "policy_spec", "predator_policy_spec", "possible_agents"),
    *("observation_space", "action_space", "single_observation_space", "single_action_space"),
    *("observation_spaces", "action_spaces", "state_space"),
}
"""Attributes that follow from the arguments."""


class Registered(Viewed):
    """Base class of environments that ``gymnasium.make`` or ``make_vec`` creates."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The specification with which Gymnasium created the environment, with its number of actions."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self._num_actions()

    def set_wrapper_attr(self, name: str, value: Any, *, force: bool = True) -> bool:
        """Set an attribute, as ``Wrapper.set_wrapper_attr`` asks for; see ``__setattr__``."""
        if force or hasattr(self, name) or self._is_setting(name):
            setattr(self, name, value)
            return True
        return False


class FlockEnvironment(Viewed):
    """Base class of the flock environments; holds one ``FlockBatch``."""

    _arguments: ClassVar[type] = FlockArguments

    def __init__(
        self,
        scenario: Scenarios | None,
        arguments: FlockArguments,
        *,
        num_flocks: int = 1,
        view: View = View.FLOCK,
    ) -> None:
        given = self._as_scenarios(scenario)
        first = given if isinstance(given, FlockScenario) else given[0]
        self._batch = batch = FlockBatch(
            given,
            options_in(first, arguments, self._arguments),
            num_flocks=num_flocks,
            view=view,
            num_threads=arguments.get("num_threads"),
            predator_policy=arguments.get("predator_policy"),
        )
        self.scenario: FlockScenario = batch.scenario  # of the first flock
        self.options: EnvOptions = batch.options
        self.policy_spec = batch.policy_spec
        seconds = first.time_step * self.options.steps_per_action
        fps = max(1, round(min(1.0 / seconds, 1000.0)))  # real time, at most 1000 pictures per second
        self._prepare_rendering(arguments, fps, count=batch.num_flocks, num_agents=first.num_agents)

    def _as_scenarios(self, given: Any) -> FlockScenario | list[FlockScenario]:
        scenario: FlockScenario = as_scenario(given, FlockScenario)
        return scenario

    def _num_actions(self) -> int:
        return self._batch.policy_spec.num_actions

    def _settle(self) -> None:
        self._refreshed(self._batch.forget(range(self._batch.num_flocks)))

    def _drop_episodes(self) -> None:
        self._batch.core.drop_episodes()

    def _show(self) -> None:
        """Pass the current state to the viewer, after a reset or a step."""
        if self._viewer is not None:
            last, trail = self._viewer.frames, self._viewer.options.trail
            self._viewer.update(live_frames(self._batch, last, trail))

    def _restore(self, state: Any, flocks: Any = None) -> Observations:
        """Restore flocks from a snapshot and return the observations of all flocks."""
        return self._refreshed(self._batch.set_state(state, flocks))

    def _refreshed(self, slots: Sequence[int]) -> Observations:
        """Begin the pictured history of some flocks again and return the observations of all flocks."""
        if self._viewer is not None:
            for slot in slots:
                self._viewer.frames[slot] = None  # the history is another one
        self._show()
        return self._batch.core.observe(range(self._batch.num_flocks))


class OneFlock(FlockEnvironment, Generic[ObsType]):
    """Base class of environments with one flock."""

    @property
    def flock(self) -> FlockView:
        """Read-only access to the state of the flock."""
        return FlockView(self._batch)

    def get_state(self) -> bytes:
        """Return a snapshot of the episode and of the seed schedule of later episodes.

        Any environment with the same scenario, options and interface can restore it, in any process. It does
        not contain the memory of policies, ``np_random`` or the random states of spaces; episodes do not draw
        from the last two.

        Raises:
            ResetNeededError: if called before ``reset``.
        """
        return self._batch.get_state()

    @survives_interrupts
    def set_state(self, state: bytes) -> ObsType:
        """Restore a snapshot, clear the memory of policies and return the observation at that moment.

        Raises:
            InputError: if the snapshot is damaged or belongs to another version, scenario, interface or
                other options; the running episode continues.
        """
        return self._resume(self._restore(state))

    def _settle(self) -> None:
        self._resume(self._refreshed(self._batch.forget([0])))

    @abstractmethod
    def _resume(self, rows: Observations) -> ObsType:
        """Return the observation when an episode begins or continues, given the flock's observation rows."""


class ManyFlocks(FlockEnvironment):
    """Base class of environments with many flocks. Snapshots contain all flocks or some."""

    def _as_scenarios(self, given: Any) -> FlockScenario | list[FlockScenario]:
        return as_scenarios(given)

    @property
    def scenarios(self) -> list[FlockScenario]:
        """The scenario of each flock."""
        return self._batch.scenarios

    @property
    def flocks(self) -> list[FlockView]:
        """Read-only access to the state of each flock."""
        return [FlockView(self._batch, slot) for slot in range(self._batch.num_flocks)]

    def render(self) -> tuple[Any, ...] | None:
        """Return one image per flock, shape (size, size, 3); in mode ``"human"`` show them side by side."""
        images = self._images()
        return None if images is None else tuple(images)

    def get_state(self, flocks: Any = None) -> bytes:
        """Return a snapshot of some flocks, or all (``None``); see ``FlockEscapeEnv.get_state``.

        Raises:
            InputError: if an index of ``flocks`` is out of bounds.
        """
        return self._batch.get_state(flocks)

    @survives_interrupts
    def set_state(self, state: bytes, flocks: Any = None) -> Observations:
        """Restore flocks from a snapshot as ``FlockEscapeEnv.set_state`` and return all flocks' observations.

        Args:
            state: a snapshot of the same number of flocks, or of one flock, which is copied to all
                ``flocks``. A snapshot of ``FlockEscapeEnv`` is one of one flock.
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            InputError: as ``FlockEscapeEnv.set_state``, or if an index is out of bounds.
            ResetNeededError: if called before ``reset`` and ``flocks`` leaves some out.
        """
        return self._restore(state, flocks)


def agent_names(kind: str, count: int) -> list[str]:
    """Return the names ``kind_0``, .. of agents, with leading zeros so that all have the same length."""
    return [f"{kind}_{i:0{len(str(count - 1))}d}" for i in range(count)]
