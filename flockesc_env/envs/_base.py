"""Base classes of the environments: constructor, rendering, snapshots, access to the state.

An environment of flocks is a subclass of ``OneFlock`` or ``ManyFlocks``. Each holds one ``FlockBatch`` and
can be copied (``copy.deepcopy``) and pickled at any time.
"""

import inspect
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy, deepcopy
from functools import wraps
from operator import attrgetter
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast, get_args

from gymnasium import logger
from gymnasium.envs.registration import EnvSpec

from flockesc_env.common.checks import as_choice, as_flag
from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.batch import FlockBatch, Observations, PredatorBatch
from flockesc_env.episodes.current_state import FlockView
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.episodes.starts import Scenarios, as_scenarios
from flockesc_env.policies.base import AnyPolicy, BasePolicy, Side
from flockesc_env.policies.registry import DEFAULT_FLOCK, as_flock_policy, as_predator_policy
from flockesc_env.policies.rules import FlyStraight
from flockesc_env.policies.setup import setup
from flockesc_env.render.frames import live_frames
from flockesc_env.render.viewer import RENDER_MODES, Image, Viewer, as_viewer
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import EnvOptions, EnvOptionsDict, LineOptionsDict
from flockesc_env.scenario.presets import as_scenario

Method = TypeVar("Method", bound=Callable[..., Any])

ObsType = TypeVar("ObsType")
"""Type of the observations that ``reset`` returns."""


class FlockArguments(EnvOptionsDict, total=False):
    """Keyword arguments of all flock environments: ``EnvOptions`` and the following.

    Attributes:
        render_mode: ``"rgb_array"``: ``render`` returns an image; ``"human"``: a window shows every reset
            and step; ``None``: no rendering. The first picture raises ``DependencyNotInstalled`` if pygame is
            not installed.
        render_size: width and height of the images in pixels, an even number from 160 to 16384; by default
            512.
        num_threads: number of threads for many flocks or one large flock; ``None``: one per core. Results do
            not depend on it.
        predator_policy: controls the ``Learned`` predators: a policy of predators, its name (``"pursue"``) or
            path, or a model of stable-baselines3. ``None``: they fly straight on, or act in ``step`` if they
            are agents.
    """

    render_mode: str | None
    render_size: int
    num_threads: int | None
    predator_policy: AnyPolicy


class LineArguments(LineOptionsDict, total=False):
    """Keyword arguments of the line environment: ``LineOptions``, and rendering as in ``FlockArguments``."""

    render_mode: str | None
    render_size: int


Infos = Literal["all", "end"]
"""Which ``info`` dicts of ``step`` have entries: all, or those of agents or slots whose episode has ended."""


def survives_interrupts(method: Method) -> Method:
    """Keep the episodes of an environment after Ctrl-C during a method, or drop them if the core lost one.

    Every method that changes an episode has this decorator. Without it, an interrupt could separate the
    state of the batch from what Python keeps beside it: agents' names, policies' memories, pictures.
    """

    @wraps(method)
    def call(self: "Viewed", *args: Any, **kwargs: Any) -> Any:
        try:
            return method(self, *args, **kwargs)
        except KeyboardInterrupt:
            try:
                self._settle()
            except BaseException:  # the core has no episode, or a second Ctrl-C
                self._drop_episodes()
            raise

    return cast("Method", call)


def named_arguments(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments of a function that have a default."""
    parameters = inspect.signature(function).parameters.values()
    return [parameter.name for parameter in parameters if parameter.default is not parameter.empty]


def read_only(name: str, path: str) -> Any:
    """Return a property for the setting at ``path``; an assignment raises and says what to do instead."""

    def assign(env: "Viewed", value: Any) -> None:
        if value is not getattr(env, name, env):  # `VecEnv` assigns the render mode that it has read
            expected = f"no assignment after creation (create an environment with the new {name})"
            raise InputError(name, expected, shown(value))

    return property(attrgetter(path), assign)


class Viewed:
    """Base class of all environments: render mode, viewer, and the options as read-only properties."""

    _arguments: ClassVar[type]
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}
    render_mode: str | None = read_only("render_mode", "_render_mode")
    _render_mode: str | None = None
    _viewer: Viewer | None = None  # Gymnasium calls `close` even if the constructor failed

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

    def _prepare_rendering(self, arguments: Mapping[str, Any], fps: int, count: int = 1) -> None:
        self._render_mode = arguments.get("render_mode")
        self._viewer = as_viewer(self._render_mode, arguments.get("render_size", 512), fps, count)
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}


for _name in EnvOptionsDict.__annotations__:  # those of a line are among them
    setattr(Viewed, _name, read_only(_name, f"options.{_name}"))


class Registered(Viewed):
    """Base class of environments that ``gymnasium.make`` or ``make_vec`` creates."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """The specification with which Gymnasium created the environment, with its number of actions."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy(spec)  # registered ones are shared
        if self._spec is not None:
            self._spec.max_episode_steps = self._num_actions()


class FlockEnvironment(Viewed):
    """Base class of the flock environments; holds one ``FlockBatch``."""

    _arguments: ClassVar[type] = FlockArguments
    scenario: FlockScenario = read_only("scenario", "_batch.scenario")  # of the first flock
    options: EnvOptions = read_only("options", "_batch.options")
    predator_policy: BasePolicy | None = read_only("predator_policy", "_batch.predator_policy")
    flock_policy: Any = read_only("flock_policy", "_batch.flock_policy")  # of environments of predators

    def __init__(
        self,
        scenario: Scenarios | None,
        arguments: FlockArguments,
        *,
        num_flocks: int = 1,
        per_agent: bool | None = None,
        max_actions: int | None = None,
        side: Side = "flock",
        flock_policy: AnyPolicy = None,
    ) -> None:
        given = self._as_scenarios(scenario)
        first = given if isinstance(given, FlockScenario) else given[0]
        options = first.env_options(arguments, self._arguments, named_arguments(type(self).__init__))
        batch: dict[str, Any] = {"num_flocks": num_flocks, "max_actions": max_actions}
        batch |= {"num_threads": arguments.get("num_threads")}
        if as_choice(side, "side", get_args(Side)) == "predator":
            self._batch: FlockBatch = _predator_batch(given, arguments, per_agent, flock_policy, batch)
        elif flock_policy is not None:
            raise InputError("flock_policy", "side='predator' beside it", shown(flock_policy))
        else:
            is_per_agent = per_agent is not None and as_flag(per_agent, "per_agent")
            given_hunter = arguments.get("predator_policy")
            hunter = None if given_hunter is None else as_predator_policy(given_hunter)
            self._batch = FlockBatch(given, options, per_agent=is_per_agent, predator_policy=hunter, **batch)
        self.policy_spec: PolicySpec = self._batch.row_spec
        seconds = first.time_step * self._batch.options.steps_per_action
        fps = max(1, round(min(1.0 / seconds, 1000.0)))  # real time, at most 1000 pictures per second
        self._prepare_rendering(arguments, fps, self._batch.num_flocks)

    def _as_scenarios(self, given: Any) -> FlockScenario | list[FlockScenario]:
        scenario: FlockScenario = as_scenario(given, FlockScenario)
        return scenario

    def _num_actions(self) -> int:
        return self._batch.policy_spec.num_actions

    def _settle(self) -> None:
        self._restart_pictures(self._batch.forget(range(self._batch.num_flocks)))

    def _drop_episodes(self) -> None:
        self._batch.core.drop_episodes()

    def _show(self) -> None:
        """Pass the current state to the viewer, after a reset or a step."""
        if self._viewer is not None:
            self._viewer.update(live_frames(self._batch, self._viewer.frames))

    def _restore(self, state: Any, flocks: Any = None) -> Observations:
        """Restore flocks from a snapshot and return the observations of all flocks."""
        self._restart_pictures(self._batch.set_state(state, flocks))
        return self._batch.observe(range(self._batch.num_flocks))

    def _restart_pictures(self, slots: Sequence[int]) -> None:
        """Begin the pictured history of some flocks again."""
        if self._viewer is not None:
            for slot in slots:
                self._viewer.frames[slot] = None  # the history is another one
        self._show()


def _predator_batch(
    given: FlockScenario | list[FlockScenario],
    arguments: FlockArguments,
    per_agent: bool | None,
    flock_policy: AnyPolicy,
    batch: dict[str, Any],
) -> PredatorBatch:
    """Return a batch whose rows are predators; the flock policy plays with the options that it knows."""
    if "predator_policy" in arguments:
        raise InputError("predator_policy", "actions of the predator in step()", "a policy")
    scenarios = [given] if isinstance(given, FlockScenario) else given
    scenarios = [each if each.num_learned else each.with_learned_predators() for each in scenarios]
    player = as_flock_policy(DEFAULT_FLOCK if flock_policy is None else flock_policy, "flock_policy")
    options: Any = {key: value for key, value in arguments.items() if key in EnvOptionsDict.__annotations__}
    entry = setup(player, scenarios[0], per_agent=per_agent, predator_policy=FlyStraight(), **options)
    batch = {**batch, "flock_policy": entry.policy, "per_agent": entry.per_agent}
    return PredatorBatch(scenarios if len(scenarios) > 1 else scenarios[0], entry.options, **batch)


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
        """
        return self._batch.get_state()

    @survives_interrupts
    def set_state(self, state: bytes) -> ObsType:
        """Restore a snapshot, clear the memory of policies and return the observation at that moment.

        A snapshot that is damaged or of another version, scenario or interface, or of other options, raises
        ``InputError``; the running episode continues.
        """
        return self._resume(self._restore(state))

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
        """Return a snapshot of some flocks, or all (``None``); see ``FlockEscapeEnv.get_state``."""
        return self._batch.get_state(flocks)

    @survives_interrupts
    def set_state(self, state: bytes, flocks: Any = None) -> Observations:
        """Restore flocks from a snapshot as ``FlockEscapeEnv.set_state`` and return all flocks' observations.

        Args:
            state: a snapshot of the same number of flocks, or of one flock, which is copied to all
                ``flocks``. A snapshot of ``FlockEscapeEnv`` is one of one flock.
            flocks: index of one flock, or indices of several; ``None``: all. Before the first ``reset``, all.
        """
        return self._restore(state, flocks)


def agent_names(kind: str, count: int) -> list[str]:
    """Return the names ``kind_0``, ``kind_1``, .. of agents."""
    return [f"{kind}_{i}" for i in range(count)]
