"""A call that needs more memory than the process may have raises MemoryError, and the environment goes on."""

import subprocess
import sys

import pytest

# Each call needs far more than the 512 MiB that the process gets.
CALLS = """
laplacian(np.zeros(100_000), 1.0)
neighbor_pairs(None, place, 1.0)
simulate(crowd, 1e9)
simulate(flock.replace(num_steps=10**9), 1.0)
simulate_line(endless, 10.0, initial_state=[0.36, 0.68] * 50_000)
sweep(flock, [1.0], range(10**9))
sweep(flock, np.ones(10_000), range(100_000))
sweep(flock.replace(num_agents=10**7), [1.0], [0])
rollout(flock, FixedRange(1.0), range(10**12))
LineEscapeEnv(LineScenario(num_agents=10**7)).reset(seed=0)
BatchVectorEnv(100_000, flock)
FlockEscapeEnv(flock.replace(num_agents=10**7))
FlockEscapeEnv(flock.replace(sensing_delay=10**8, num_steps=10**9))
frozen.step(np.array([[0.1], [1e9]], np.float32))
"""

SCRIPT = """
import resource
import numpy as np
from flockesc_env import *
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models.graph import laplacian, neighbor_pairs

flock, place = FlockScenario(num_agents=10), np.zeros((100_000, 2))
crowd = FlockScenario(num_agents=100_000, num_steps=9, frozen_graph=True)
# Two groups that chase each other past the predator for ever.
endless = LineScenario(num_agents=100_000, escape_force="linear_as_printed", max_steps=10**9)
options = dict(action_mode="range", max_range=1e9, num_threads=1)
frozen, twin = (BatchVectorEnv(2, crowd, **options) for _ in range(2))
for env in (frozen, twin):
    env.reset(seed=0)
# The first call starts the threads of the package, whose stacks are address space.
sweep(flock.replace(num_steps=1), [1.0], range(2))
most = 1024 * int(open("/proc/self/status").read().split("VmSize:")[1].split()[0]) + 2**29
resource.setrlimit(resource.RLIMIT_AS, (most, most))
for call in CALLS.strip().split("\\n"):
    try:
        eval(call)
    except MemoryError as error:
        assert str(error), call
    else:
        raise AssertionError(call)
steps = [env.step(np.full((2, 1), 0.1, np.float32)) for env in (frozen, twin)]
assert all(np.array_equal(*pair) for pair in zip(*(step[:2] for step in steps)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_AS and /proc are Linux's")
def test_memory_errors_leave_the_environment_usable() -> None:
    command = [sys.executable, "-c", f"CALLS = {CALLS!r}\n{SCRIPT}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)  # noqa: S603
    assert done.returncode == 0, done.stderr
