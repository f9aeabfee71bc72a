"""TorchRL environment of many flocks: one range per agent, or one per flock."""

from collections.abc import Sequence
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.extras import require
from flockesc_env.envs._base import FlockArguments, ManyFlocks, agent_names, survives_interrupts
from flockesc_env.episodes.batch import Columns, Observations, is_over
from flockesc_env.episodes.starts import Scenarios, consecutive_seeds, fresh_seed
from flockesc_env.scenario.flock import FlockScenario

require("torchrl", ["torchrl"])
import torch  # noqa: E402, after the check
from tensordict import TensorDict, TensorDictBase  # noqa: E402
from torchrl.data import Bounded, Categorical, Composite, TensorSpec, Unbounded  # noqa: E402
from torchrl.envs import EnvBase  # noqa: E402

GROUP: Final = "agents"
"""Name of the group that holds the entries of all agents."""

ENDS: Final = ("done", "terminated", "truncated")

INFO: Final = tuple(FlockScenario.objectives)
"""Names of the entries of ``"info"``: the objectives so far."""

Ended = NDArray[np.bool]


class FlockTorchRLEnv(ManyFlocks, EnvBase):
    """Many flocks under attack as one TorchRL environment of batch size (num_flocks,).

    With one range per agent, the group ``"agents"`` of shape (num_flocks, n) contains ``"observation"``,
    ``"action"``, ``"reward"``, ``"done"``, ``"terminated"`` and ``"truncated"``, as in TorchRL's ``VmasEnv``.
    With one range per flock, these entries are at the root. The root also has the end of each flock's episode
    and, in ``"info"``, ``"min_mean_distance"`` (J_mean so far), ``"min_min_distance"`` (J_min so far) and
    ``"fraction_surviving"``, shape (num_flocks, 1).

    It returns the same values as ``parallel_env``. ``set_seed(s)`` gives flock f the seed ``s + f``; later
    episodes follow the seed schedule (``episode_seed``). An entry ``"_reset"`` resets some flocks.

    If a scenario has a ``capture_radius``, ``("agents", "mask")`` is False for caught agents. A caught
    agent keeps its row until the episode of its flock ends: its observation is zeros, its reward is 0, its
    action is ignored, and it is terminated.

    Args:
        num_flocks: number of flocks.
        scenario: as for ``BatchVectorEnv``.
        per_agent: True: every agent has its own range and observation. False: every flock has one.
        device: device of the tensors. The flocks are computed on the CPU.
        **arguments: see ``FlockArguments`` and ``EnvOptions``. ``render`` returns one image per flock.

    Attributes:
        group_map: names of the agents of each group; empty with one range per flock.
    """

    def __init__(
        self,
        num_flocks: int,
        scenario: Scenarios | None = None,
        *,
        per_agent: bool = True,
        device: torch.device | str = "cpu",
        **arguments: Unpack[FlockArguments],
    ) -> None:
        super().__init__(scenario, arguments, num_flocks=num_flocks, per_agent=per_agent)
        flocks, agents = self._batch.num_flocks, self._batch.rows
        EnvBase.__init__(self, device=torch.device(device), batch_size=torch.Size([flocks]))
        self._rows = (flocks, agents) if self.policy_spec.per_agent else (flocks,)
        self._has_mask = self._batch.rows_can_be_caught
        self._seeds: list[int | None] = [None] * flocks
        self.group_map = {GROUP: agent_names("agent", agents)} if self.policy_spec.per_agent else {}
        self._make_specs()

    def close(self, *, raise_if_closed: bool = True) -> None:
        ManyFlocks.close(self)
        EnvBase.close(self, raise_if_closed=raise_if_closed)

    def _make_specs(self) -> None:
        actions, layout = self.policy_spec.actions, self.policy_spec.layout
        rows, flocks = (*self._rows, 1), (*self.batch_size, 1)
        bounds = torch.tensor(layout.low), torch.tensor(layout.high)
        observation = {"observation": Bounded(*bounds).expand(*self._rows, len(layout.names))}
        if self._has_mask:
            observation["mask"] = _flag(self._rows)
        space: Any = actions.space()
        action = (
            Bounded(space.low.item(), space.high.item(), rows)
            if actions.grid is None
            else Categorical(len(actions.grid), self._rows, dtype=torch.int64)
        )
        info = {name: Unbounded(flocks, dtype=torch.float64) for name in INFO}
        self.full_action_spec = self._nested({"action": action})
        self.full_reward_spec = self._nested({"reward": Unbounded(rows)})
        self.full_observation_spec = self._nested(observation, info=Composite(info, shape=self.batch_size))
        self.full_done_spec = self._nested(
            dict.fromkeys(ENDS, _flag(rows)), **dict.fromkeys(ENDS, _flag(flocks))
        )

    def _nested(self, specs: dict[str, TensorSpec], **root: TensorSpec) -> Composite:
        """Return the spec of entries of the agents, in their group if there is one, and of the root."""
        entries = {GROUP: Composite(specs, shape=self._rows)} if self.group_map else specs
        return Composite({**entries, **root}, shape=self.batch_size)

    def _set_seed(self, seed: int | None) -> None:
        self._seeds = list(consecutive_seeds(fresh_seed() if seed is None else seed, len(self._seeds)))

    @survives_interrupts
    def _reset(
        self, tensordict: TensorDictBase | None = None, options: dict[str, Any] | None = None
    ) -> TensorDictBase:
        flocks = range(len(self._seeds))
        mask = None if tensordict is None else tensordict.get("_reset", None)
        slots = list(flocks) if mask is None else np.flatnonzero(mask.cpu().numpy()).tolist()
        observations, _ = self._batch.reset(slots, [self._seeds[slot] for slot in slots], [options])
        for slot in slots:
            self._seeds[slot] = None
        if len(slots) < len(flocks):
            observations = self._batch.core.observe(flocks)
        self._show()
        return self._output(observations, self._batch.core.ended(), self._batch.core.metrics())

    @survives_interrupts
    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        actions = tensordict.get(self.action_key).detach().cpu().numpy()
        stacked = actions.reshape(-1, *actions.shape[len(self._rows) :])
        observations, rewards, ended, _, columns = self._batch.step(stacked)
        self._show()
        return self._output(observations, ended, columns, rewards)

    def _output(
        self, observations: Observations, ended: Ended, columns: Columns, rewards: FloatArray | None = None
    ) -> TensorDict:
        """Return the result of a reset or, with rewards, of a step; it shares the memory of the arrays."""
        entries: dict[str, NDArray[Any]] = {"observation": observations.reshape(*self._rows, -1)}
        if rewards is not None:
            entries["reward"] = rewards.astype(np.float32).reshape(*self._rows, 1)
        root: dict[str, Any] = _ends(is_over(columns)[:, None], ended[:, None])
        if self.group_map:
            caught = self._batch.core.caught() if self._has_mask else np.zeros(self._rows, np.bool)
            entries |= _ends(caught[..., None], ended[:, None, None])
            if self._has_mask:
                entries["mask"] = ~caught
            root[GROUP] = self._tensors(entries, self._rows)
        else:
            root |= entries
        root["info"] = self._tensors({name: columns[name][:, None] for name in INFO}, self.batch_size)
        return self._tensors(root, self.batch_size)

    def _tensors(self, entries: dict[str, Any], shape: Sequence[int]) -> TensorDict:
        tensors = {
            name: torch.from_numpy(entry) if isinstance(entry, np.ndarray) else entry
            for name, entry in entries.items()
        }
        return TensorDict(tensors, shape, device=self.device)


def _ends(terminated: Ended, ended: Ended) -> dict[str, Ended]:
    truncated = ended & ~terminated
    return {"done": terminated | truncated, "terminated": terminated, "truncated": truncated}


def _flag(shape: Sequence[int]) -> Categorical:
    return Categorical(2, torch.Size(shape), dtype=torch.bool)
