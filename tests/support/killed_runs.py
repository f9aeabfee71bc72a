"""Trains, kills and resumes runs, and compares them with runs that nobody interrupts."""

from __future__ import annotations

import dataclasses
import os
import pickle
import signal
import time
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import torch
from resume_child import run
from small_runs import LEARNERS, small_run
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd
from training.config import Args
from training.outputs import CHECKPOINT
from training.record import CURVE_FILE, POLICY_FILE

from flockesc_env.policies.files import load_policy

ROUNDS = {"num_episodes": 10, "checkpoint_every": 1}
GENERATIONS = {"generations": 16, "checkpoint_every": 1}
FITS = {"rounds": 10, "checkpoint_every": 1}

context = get_context("forkserver")


def started(args: Args, weights: Path) -> BaseProcess:
    process = context.Process(target=run, args=(args, weights))
    process.start()
    return process


def killed_after(args: Args, weights: Path, checkpoints: int, delay: float) -> bool:
    """Kill a run some time after it has written some checkpoints; return whether it was still under way."""
    process, seen, file = started(args, weights), set[int](), args.run / CHECKPOINT
    before = file.stat().st_mtime_ns if file.exists() else None
    while process.is_alive() and len(seen) < checkpoints:
        with suppress(FileNotFoundError):
            seen |= {file.stat().st_mtime_ns} - {before}
        time.sleep(0.001)
    time.sleep(delay)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    return process.exitcode == -signal.SIGKILL and not (args.run / POLICY_FILE).exists()


def finished(args: Args, weights: Path) -> None:
    process = started(args, weights)
    process.join()
    assert process.exitcode == 0


def same(one: Any, other: Any) -> bool:
    """Compare nested parameters bit by bit."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, ReplayBuffer | RunningMeanStd):
        return same(vars(one), vars(other))
    if isinstance(one, torch.Tensor):
        return torch.equal(one, other)
    return np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other


def check_killed_run(learner: str, folder: Path) -> None:
    """Check that a run that is killed twice and resumed ends with the bits of an uninterrupted run."""
    size = {"search": GENERATIONS, "imitation": FITS}.get(learner, ROUNDS)
    undisturbed = small_run(folder / "undisturbed", learner, **size)
    killed = dataclasses.replace(undisturbed, run=folder / "killed")
    finished(undisturbed, folder / "one")

    delays = np.random.default_rng(LEARNERS.index(learner)).uniform(0, 0.05, 2)
    for count, delay in enumerate(delays, start=1):
        assert killed_after(killed, folder / "other", count, delay)
    finished(killed, folder / "other")

    policies = [load_policy(args.run / POLICY_FILE).policy for args in (undisturbed, killed)]
    assert policies[0].parameters.tobytes() == policies[1].parameters.tobytes()
    curves = [pl.read_parquet(args.run / CURVE_FILE).drop("seconds") for args in (undisturbed, killed)]
    assert curves[0].equals(curves[1])
    if size is ROUNDS:
        one, other = (pickle.loads((folder / name).read_bytes()) for name in ("one", "other"))  # noqa: S301
        assert same(one, other)
        assert not same(one, {**other, "num_timesteps": 0})
