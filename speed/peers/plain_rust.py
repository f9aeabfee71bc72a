"""Peers in plain scalar Rust (rust/peers), with this project's release profile: all pairs and a cell list."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from speed.peers.model import Floats, Model, Peer, one_by_one

_ROOT = Path(__file__).parents[2]


@cache
def module() -> ModuleType:
    """Compile the crate ``flockesc-peers`` and import it.

    Raises:
        CalledProcessError: if the compilation fails.
    """
    command = ["cargo", "build", "--release", "--locked", "--quiet", "--package", "flockesc-peers"]
    subprocess.run(command, cwd=_ROOT, check=True)
    loader = ExtensionFileLoader("flockesc_peers", str(_ROOT / "target/release/libflockesc_peers.so"))
    built = module_from_spec(ModuleSpec(loader.name, loader, origin=loader.path))
    loader.exec_module(built)
    return built


def _peer(name: str, function: str) -> Peer:
    def run(
        model: Model, positions: Floats, velocities: Floats, interaction_range: float, steps: int
    ) -> tuple[Floats, float]:
        outcome: tuple[Floats, float] = getattr(module(), function)(
            model, positions, velocities, interaction_range, steps
        )
        return outcome

    return Peer(name, one_by_one(run))


PEERS = (
    _peer("plain Rust, all pairs", "flock_all_pairs"),
    _peer("plain Rust, cell list", "flock_cells"),
)
