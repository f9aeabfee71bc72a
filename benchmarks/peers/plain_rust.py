"""Plain scalar Rust (rust/peers) under the project's own release profile: all pairs, and a cell list."""

from __future__ import annotations

import subprocess
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from benchmarks.peers.model import Peer, one_by_one

_ROOT = Path(__file__).parents[2]


def build() -> ModuleType:
    """Build the crate ``flockesc-peers`` and import it.

    Raises:
        CalledProcessError: if it does not compile.
    """
    command = ["cargo", "build", "--release", "--locked", "--quiet", "--package", "flockesc-peers"]
    subprocess.run(command, cwd=_ROOT, check=True)
    loader = ExtensionFileLoader("flockesc_peers", str(_ROOT / "target/release/libflockesc_peers.so"))
    module = module_from_spec(ModuleSpec(loader.name, loader, origin=loader.path))
    loader.exec_module(module)
    return module


MODULE = build()
PEERS = (
    Peer("plain Rust, all pairs", one_by_one(MODULE.flock_all_pairs)),
    Peer("plain Rust, cell list", one_by_one(MODULE.flock_cells)),
)
