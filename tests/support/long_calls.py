"""Calls that take long, and a program that interrupts one: ``NAME TRIES``.

It prints a JSON list of the seconds of processor time from signal to exception; null if a call ended before.
Calls run on one thread, so that this is the time on a machine with nothing else to do.
"""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import flockesc_env as fe
from flockesc_env.common.checks import in_job
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import Flock, graph
from flockesc_env.policies import Architecture, FixedRange
from flockesc_env.scenario import Topological, Voronoi

FOREVER = 10**9
DELAY = 0.15
"""Seconds of processor time from the beginning of a call to the signal."""
CYCLE = [0.36, 0.68] * 50

small = fe.FlockScenario(num_steps=FOREVER)
crowd = fe.FlockScenario(num_agents=100_000, initial_side=1826.0, num_steps=FOREVER)
huge = fe.FlockScenario(num_agents=1_000_000, initial_side=5774.0, num_steps=10)
dense = fe.FlockScenario(num_agents=10_000, initial_side=100.0, blind_angle=1.0, num_steps=100)
line = fe.LineScenario(escape_force="linear_as_printed", max_steps=FOREVER)
points = np.random.default_rng(0).uniform(0.0, 1.0, (1_000_000, 2))
mutual = fe.FlockScenario(num_agents=len(points), blind_angle=1.0, mutual=True)

Call = Callable[[], Any]


def step(env: Any, actions: Any, **options: Any) -> Call:
    def call() -> None:
        env.reset(seed=0, **options)
        armed()
        env.step(actions)

    return call


def profiled() -> Any:
    scenario = fe.FlockScenario(num_agents=20_000, initial_side=816.0)
    candidates = tuple(np.linspace(5.0, 300.0, 64).tolist())
    return BatchVectorEnv(20_000, scenario, per_agent=True, max_range=300.0, profile_ranges=candidates)


def gymnasium_step(scenario: fe.FlockScenario, rho: float = 10.0, **options: Any) -> Call:
    return step(fe.FlockEscapeEnv(scenario, action_mode="range", **options), np.array([rho], np.float32))


def vector_step() -> Call:
    env = BatchVectorEnv(64, small, action_mode="range", steps_per_action=10_000, copy=False)
    return step(env, np.full((64, 1), 10.0, np.float32))


def parallel_step() -> Call:
    flock = fe.FlockScenario(num_agents=5000, initial_side=400.0)
    env = fe.parallel_env(flock, action_mode="range", reward="difference")
    return step(env, dict.fromkeys(env.possible_agents, np.array([10.0], np.float32)))


def flock_steps(scenario: fe.FlockScenario, rho: float) -> Call:
    flock = Flock(scenario, seed=0)
    return lambda: flock.step(rho, FOREVER)


def observation() -> Call:
    """Agents search for their 1,000 nearest ones under eight candidate ranges."""
    scenario = fe.FlockScenario(num_agents=3000, initial_side=300.0, neighbor_rule=Topological())
    env = fe.parallel_env(scenario, max_range=1008, profile_ranges=tuple(range(1000, 1008)))
    env.reset(seed=0)
    state = env.get_state()
    return lambda: env.set_state(state)


def line_step() -> Call:
    env = fe.LineEscapeEnv(line, action_mode="range", max_range=10.0, steps_per_action=FOREVER)
    return step(env, np.array([10.0], np.float32), options={"initial_state": CYCLE})


def network() -> Call:
    """The outputs of all rows take minutes on any processor."""
    spec = fe.FlockEscapeEnv(small).policy_spec
    architecture = Architecture(spec.layout.names, (2_000, 2_000))
    policy = fe.NetworkPolicy(architecture, np.zeros(architecture.size))
    rows = np.zeros((1_000_000, len(spec.layout.names)), np.float32)
    return lambda: policy.act(rows, spec)


CALLS: dict[str, Callable[[], Call]] = {
    "simulate": lambda: lambda: fe.simulate(fe.FlockScenario(num_agents=2000, num_steps=50_000), 1.0, seed=0),
    "simulate, a step takes long": lambda: lambda: fe.simulate(dense, 50.0, seed=0),
    "steps of 1,000,000 agents": lambda: flock_steps(huge, 10.0),
    "a step of a flock takes long": lambda: flock_steps(dense, 50.0),
    "simulate_line": lambda: lambda: fe.simulate_line(line, 10.0, initial_state=CYCLE),
    "sweep": lambda: lambda: fe.sweep(small, [1.0], range(9)),
    "sweep with progress": lambda: lambda: fe.sweep(small, [1.0, 2.0], range(9), progress=lambda *_: None),
    "sweep, lines": lambda: lambda: fe.sweep(line.replace(num_agents=2), [1.0], [2, 3]),
    "a network of many rows": network,
    "rollout": lambda: lambda: fe.rollout(crowd, FixedRange(10.0), range(64)),
    "step, 10,000 steps per action": lambda: gymnasium_step(
        crowd.replace(num_agents=5000), steps_per_action=10_000
    ),
    "step, 99 steps of Voronoi neighbors": lambda: gymnasium_step(
        crowd.replace(neighbor_rule=Voronoi(), num_agents=30_000), steps_per_action=99
    ),
    "step of a vector environment": vector_step,
    "step with difference rewards": parallel_step,
    "step of a line": line_step,
    "step, 64 candidate ranges": lambda: step(profiled(), np.zeros((20_000, 1), np.float32)),
    "observation, topological candidates": observation,
    "reset of 1,000,000 agents": lambda: lambda: fe.FlockEscapeEnv(huge).reset(seed=0),
    "perron_matrix": lambda: lambda: graph.perron_matrix(points[:15_000, 0], 0.1),
    "laplacian": lambda: lambda: graph.laplacian(points[:15_000, 0], 0.1),
    "neighbor_pairs": lambda: lambda: graph.neighbor_pairs(None, points[:30_000], 0.2),
    "component_labels": lambda: lambda: graph.component_labels(mutual, points, 0.05, velocities=points),
}

at = [0.0]


def armed() -> None:
    """Let the kernel send a signal in a moment, also while a call holds the interpreter."""
    at[0] = time.process_time() + DELAY
    signal.setitimer(signal.ITIMER_PROF, DELAY)


def latency(call: Call, arms_itself: bool) -> float | None:
    """Return the seconds from signal to exception; ``None`` if the call ended before the signal."""
    try:
        if not arms_itself:
            armed()
        call()
        signal.setitimer(signal.ITIMER_PROF, 0)
    except KeyboardInterrupt:
        return time.process_time() - at[0]
    return None


def interrupted(name: str, tries: int) -> list[float | None]:
    """Return the latencies of a call in a process that works afterwards."""
    command = [sys.executable, __file__, name, str(tries)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)  # noqa: S603
    return json.loads(ended.stdout)


if __name__ == "__main__":
    signal.signal(signal.SIGPROF, signal.default_int_handler)  # as Ctrl-C
    with in_job():
        made = CALLS[sys.argv[1]]()
        arms_itself = made.__name__ == "call"
        tries = [latency(made, arms_itself) for _ in range(int(sys.argv[2]))]
    assert fe.sweep(fe.FlockScenario(num_agents=5, num_steps=5), [1.0], range(4)).min_mean_distance.all()
    print(json.dumps(tries))
