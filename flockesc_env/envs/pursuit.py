"""Gymnasium: the action steers the predator of a flock that follows a policy of its own."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_policy, as_seed
from flockesc_env.common.errors import EpisodeError, ScenarioError
from flockesc_env.envs._rendered import Rendered
from flockesc_env.envs._restorable import Restorable
from flockesc_env.episodes.batch import FlockBatch, Observations, infos, is_over
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import opposite, with_learned
from flockesc_env.policies.base import Policy
from flockesc_env.policies.ranges import FixedRange
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer


class FlockPursuitEnv(Rendered, Restorable[NDArray[np.float32]], gymnasium.Env[NDArray[np.float32], Any]):
    """A predator after a flock, ``flockesc/FlockPursuit-v0``; the action is its acceleration.

    Observations ("Predator view"), rewards, which are minus those of the flock, and ``info`` are described in
    docs/model.md. The horizon truncates; the episode terminates when all agents are caught.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's. One of its predators
            is ``Learned``, or there is only one, which then becomes so.
        flock_policy: sets the ranges of the flock; default: ``FixedRange(10.0)``.
        per_agent: whether that policy sets one range per agent, or one for the flock.
        render_mode: ``"rgb_array"``: ``render`` returns a picture; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which a large flock is spread; ``None``: one per core.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: for a bad ``num_threads``.
        ScenarioError: for an option out of bounds or a scenario without a predator to steer, or with several.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        flock_policy: Policy | None = None,
        per_agent: bool = False,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        num_threads: int | None = None,
        **options: Any,
    ) -> None:
        self._batch = FlockBatch(
            with_learned(as_scenario(scenario, FlockScenario)),
            EnvOptions(**options),
            per_agent=per_agent,
            num_threads=num_threads,
        )
        self.scenario = self._batch.scenario
        self.options = self._batch.options
        self.policy_spec = self._batch.predator_policy_spec
        if self.policy_spec.count != 1:
            raise ScenarioError("predators", "one predator to steer", self.policy_spec.count)
        self.flock_policy = (
            FixedRange(10.0) if flock_policy is None else as_policy(flock_policy, "flock_policy")
        )
        self._flock_sees: Observations = np.zeros((0, 0), np.float32)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.space()
        fps = frames_per_second(self.scenario.time_step * self.options.steps_per_action)
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}
        self.render_mode = render_mode
        self._viewer: FlockViewer | None = flock_viewer(self._batch, render_mode, render_options, fps)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; see ``FlockEscapeEnv.reset``.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        start = self._batch.start(options)
        if seed is not None:
            seed = as_seed(seed)
            super().reset(seed=seed)
        self._flock_sees, columns = self._batch.reset([0], [seed], start)
        reset_policy(self.flock_policy, np.ones(len(self._flock_sees), bool))
        if self._viewer is not None:
            self._viewer.update()
        return self._batch.observe_predators([0])[0], infos(columns)[0]

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the acceleration, and the ranges that the flock's policy sets, for ``steps_per_action`` steps.

        Args:
            action: shape (D,): ahead, to the left and, in space, up, over the largest acceleration.

        Raises:
            ActionError: for an action outside of the action space.
            EpisodeError: before ``reset``, or after the horizon.
        """
        if not self._flock_sees.size:
            raise EpisodeError("step", "a reset before anything else", "no episode")
        controls = self.policy_spec.plain_one(action)
        ranges = self.flock_policy.act(self._flock_sees, self._batch.policy_spec)
        self._flock_sees, rewards, ended, _, columns = self._batch.step(ranges, controls=controls)
        if self._viewer is not None:
            self._viewer.update()
        reward = opposite(rewards, is_own=self.options.is_own)
        terminated = bool(is_over(columns)[0])
        truncated = bool(ended[0]) and not terminated
        return self._batch.observe_predators([0])[0], reward, terminated, truncated, infos(columns)[0]

    def _seen_now(self) -> NDArray[np.float32]:
        self._flock_sees = self._batch.observe([0])
        observation: NDArray[np.float32] = self._batch.observe_predators([0])[0]
        return observation
