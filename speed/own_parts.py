"""Benchmark of the examples of docs/your-own-parts.md, beside the same environments without them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from flockesc_env import FlockEscapeEnv, FlockScenario, parallel_env
from flockesc_env.sb3 import vec_env
from speed.environments import AGENTS, ID, RANGE, steps
from speed.measure import EVERY_STEP, Comparison
from speed.peers import Peer


def own_parts(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:  # noqa: ARG001
    """Compare a model step with and without each example."""
    page, own = Path("docs/your-own-parts.md").read_text("utf-8"), dict[str, Any]()
    for block in re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE):
        exec(block, own)  # noqa: S102, our own text
    options: dict[str, Any] = {**EVERY_STEP, "action_mode": "range"}
    flock, chased = gymnasium.make(ID, **options), FlockScenario().with_learned_predators()
    slots = vec_env(num_flocks=4, per_agent=True, reward="individual", num_threads=1, **options)
    for envs in (
        {"flock": flock, "KeepTogether": own["KeepTogether"](flock), "WithShape": own["WithShape"](flock)},
        {"4 flocks": slots, "CostOfListening": own["CostOfListening"](slots)},
        {"learned predator": FlockEscapeEnv(chased, **options)}
        | {"Circle": FlockEscapeEnv(chased, predator_policy=own["Circle"](), **options)},
    ):
        actions = np.full((4 * AGENTS, 1) if "4 flocks" in envs else 1, RANGE, np.float32)
        entries = [steps(name, env.reset, partial(env.step, actions)) for name, env in envs.items()]
        yield Comparison(entries, "model step")
    agents, policy = parallel_env(**{**options, "predator_sensing_range": 30.0}), own["ListenUntilSeen"]()
    rows, ranges = [agents.reset_array(seed=0)[0]], np.full((AGENTS, 1), RANGE, np.float32)

    def act() -> None:
        rows[0] = agents.step_array(policy.act(rows[0], agents.policy_spec))[0]

    def reset() -> None:
        rows[0] = agents.reset_array(seed=0)[0]
        policy.reset(np.ones(AGENTS, bool))

    alone = steps("agents", partial(agents.reset_array, seed=0), lambda: agents.step_array(ranges))
    yield Comparison([alone, steps("ListenUntilSeen", reset, act)], "model step")
