"""Snapshots of every preset and of policies with a memory; foreign snapshots.

Of every interface: ``test_state_machine.py``. Damaged ones: ``test_arguments.py``. In other processes:
``test_processes.py``.
"""

import pickle

import numpy as np
import pytest
from envs import ADAPTERS, FLOCK, REMEMBERING, Weave, play, start

import flockesc_env as fe

STEPS = 25
"""Number of steps, which reaches the third episode."""


@pytest.mark.parametrize("name", [name for name in fe.PRESETS if name != "order"])
def test_every_preset(name: str) -> None:
    """Presets cover all neighbor rules, laws of motion, predators, captures, noise and randomization.

    Environments need a predator, which the periodic domain of "order" cannot have.
    """

    def make() -> fe.FlockEscapeEnv | fe.LineEscapeEnv:
        is_line = isinstance(fe.PRESETS[name].scenario, fe.LineScenario)
        return fe.LineEscapeEnv(name) if is_line else fe.FlockEscapeEnv(name, max_range=20.0)

    env, restored = make(), make()
    env.reset(seed=3)
    play(env, np.random.default_rng(0), 15)
    restored.reset(seed=77)
    restored.set_state(env.get_state())
    pickled = pickle.loads(pickle.dumps(env))  # noqa: S301, our own
    expected = play(env, np.random.default_rng(1), 15)
    for other in (restored, pickled):
        assert play(other, np.random.default_rng(1), 15) == expected


@pytest.mark.parametrize("interface", REMEMBERING)
def test_two_restores_of_one_snapshot_are_equal(interface: str) -> None:
    """Restoring clears the memory of policies, which a snapshot does not contain."""
    env, other = (REMEMBERING[interface](predator_policy=Weave()) for _ in range(2))
    start(env, 3)
    play(env, np.random.default_rng(0), 4)
    state = env.get_state()
    continued = []
    for each in (env, env, other):
        each.set_state(state)
        continued.append(play(each, np.random.default_rng(1), STEPS))
    assert continued[0] == continued[1] == continued[2]


@pytest.mark.parametrize("interface", ["gymnasium", "parallel", "line", "vector", "stable-baselines3"])
def test_foreign_states_are_refused(interface: str) -> None:
    env = ADAPTERS[interface].make()
    others = (fe.FlockEscapeEnv(FLOCK, reward="terminal"), fe.FlockEscapeEnv(FLOCK.replace(speed=9.0)))
    refused = []
    for other in (*others, fe.parallel_env(FLOCK)):
        other.reset(seed=0)
        refused.append(other.get_state())
    start(env, 0)
    play(env, np.random.default_rng(0), 2)
    good = env.get_state()
    for state in refused:
        with pytest.raises(fe.InputError, match="state: expected"):
            env.set_state(state)
    assert env.get_state() == good
