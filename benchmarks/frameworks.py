"""Samples per second of trainers with the package's adapters and through PettingZoo, and the examples' gains.

Run it in the environment of a framework: ``.compat/torchrl/bin/python -m benchmarks.frameworks torchrl``.
It writes ``results/frameworks/torchrl.json``.
"""

from __future__ import annotations

import argparse
import json
import re
import runpy
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from benchmarks.machine import description
from flockesc_env import parallel_env

ROOT = Path(__file__).parent.parent
EXAMPLES = {"torchrl": "torchrl_ppo.py", "benchmarl": "benchmarl_mappo.py"}

FLOCKS, AGENTS, STEPS, SEED = 4, 300, 60, 0
REPETITIONS = 2

Iteration = Callable[[], float]
"""Trains for one iteration, ``FLOCKS`` episodes of ``STEPS`` actions, and returns the CPU seconds."""


def torchrl(example: dict[str, Any]) -> tuple[Iteration, Iteration]:
    """Return iterations of the example with ``FlockTorchRLEnv`` and with ``PettingZooWrapper``."""
    from torchrl.envs import SerialEnv

    from flockesc_env.torchrl import FlockTorchRLEnv

    options = {**example["OPTIONS"], "reward": "individual_running_minimum"}
    own = FlockTorchRLEnv(FLOCKS, **options)
    peer = SerialEnv(FLOCKS, lambda: _wrapped(options))
    return lambda: _seconds(example["train"], own, 1), lambda: _seconds(example["train"], peer, 1)


def benchmarl(example: dict[str, Any]) -> tuple[Iteration, Iteration]:
    """Return iterations of the example with ``FlockTask`` and with a task over ``PettingZooWrapper``."""
    from flockesc_env.benchmarl import FlockTask

    tasks: list[Any] = [FlockTask.PER_AGENT_VISIBLE.get_task() for _ in range(2)]  # type: ignore[attr-defined]
    own, peer = tasks
    peer.get_env_fun = partial(_env_fun, peer.config)  # BenchMARL pickles the task
    peer.log_info = _no_info
    folder = Path(mkdtemp())

    def train(task: Any) -> float:
        return _seconds(example["make_experiment"](task, 1, FLOCKS, SEED, folder).run)

    return lambda: train(own), lambda: train(peer)


def _env_fun(options: dict[str, Any], **_: Any) -> Callable[[], Any]:
    return lambda: _wrapped(options)


def _no_info(_: Any) -> dict[str, float]:
    return {}


def _wrapped(options: dict[str, Any]) -> Any:
    from torchrl.envs import PettingZooWrapper
    from torchrl.envs.utils import MarlGroupMapType

    group_map = MarlGroupMapType.ALL_IN_ONE_GROUP
    return PettingZooWrapper(parallel_env(**options), group_map=group_map, use_mask=False)


def _seconds(train: Callable[..., Any], *arguments: Any) -> float:
    start = time.process_time()
    train(*arguments)
    return time.process_time() - start


def measure(framework: str, iterations: int) -> dict[str, Any]:
    """Return the record of a framework.

    Args:
        framework: a key of ``EXAMPLES``.
        iterations: number of iterations of the example that measures the gain.
    """
    import torch

    torch.set_num_threads(1)
    path = ROOT / "examples" / EXAMPLES[framework]
    own, peer = {"torchrl": torchrl, "benchmarl": benchmarl}[framework](runpy.run_path(str(path)))
    seconds = [
        (own(), peer(), own()) for _ in range(REPETITIONS)
    ]  # interleaved: the load of the machine varies
    samples = FLOCKS * AGENTS * STEPS
    command = ["examples/" + path.name, "--iterations", str(iterations), "--seed", str(SEED)]
    done = subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True, check=True)
    gain, low, high = map(float, re.findall(r"[-+]\d+\.\d+", done.stdout.splitlines()[-1]))
    return {
        "framework": framework,
        "versions": {name: version(name) for name in sorted({framework, "torchrl", "torch", "pettingzoo"})},
        "command": " ".join(["python", *command]),
        "seed": SEED,
        "samples_per_second": round(samples / min(min(first, last) for first, _, last in seconds)),
        "pettingzoo_samples_per_second": round(samples / min(middle for _, middle, _ in seconds)),
        "lines": len(path.read_text().splitlines()),
        "gain": gain,
        "interval": [low, high],
        "processor": description()["cpu"],
    }


def main() -> None:
    """Measure one framework and write its record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("framework", choices=EXAMPLES)
    parser.add_argument("--iterations", type=int, default=45)
    args = parser.parse_args()
    record = measure(args.framework, args.iterations)
    output = ROOT / "results" / "frameworks" / f"{args.framework}.json"
    output.parent.mkdir(exist_ok=True)
    output.write_text(json.dumps(record, indent=2) + "\n")


if __name__ == "__main__":
    main()
