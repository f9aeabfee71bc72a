"""Peers in plain scalar Rust (rust/peers), with this project's release profile: all pairs and a cell list."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from speed.peers import Peer, one_by_one

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


PEERS = (
    Peer("plain Rust, all pairs", one_by_one(lambda *args: module().flock_all_pairs(*args)), largest=30_000),
    Peer("plain Rust, cell list", one_by_one(lambda *args: module().flock_cells(*args))),
)
