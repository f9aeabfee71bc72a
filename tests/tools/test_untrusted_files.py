"""Untrusted files: any content gives a documented error or a valid result."""

import io
import json
import random
import re
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import Cli, npz, policy_file
from option_table import small_flock

import flockesc_env
from flockesc_env import FlockScenario, InputError, LineScenario, load_policy, load_run, save_policy, save_run
from flockesc_env.cli.output import Exit
from flockesc_env.policies import Architecture, PredatorNetwork

MUTATIONS = 100
"""Number of mutations per kind of file."""

MEMORY = 2**24
"""Most bytes that reading a small file may allocate, even if it declares huge sizes."""

SCENARIO = small_flock()


LINE = LineScenario(num_agents=5)
ESCAPES = "\x1b]0;title\x07\x1b[2J\t\x9b1m\x7f\u202e\u2028\u200b\r\nflock.npz: matches"


TOKEN = re.compile(r'"[^"]*"|[\w.+-]+')
READERS = {
    "policy": ["simulate", "FILE", "--set", "num_agents=5", "--set", "num_steps=2"],
    "predator": ["simulate", "fixed:1", "--predator", "FILE", "--set", "num_steps=2"],
    "run": ["replay", "FILE"],
    "line": ["replay", "FILE"],
    "scenario": ["simulate", "fixed:1", "--seed", "1", "--scenario", "FILE"],
}
"""A command that reads each kind of file."""


def write_predator(path: Path) -> None:
    network = PredatorNetwork(Architecture(("time",), ()), [0.5, 1.0, 0.25, -1.0])
    save_policy(network.with_options(scenario=SCENARIO.with_learned_predators()), path)


def read_scenario(path: Path) -> FlockScenario:
    text = path.read_bytes().decode("utf-8", "replace")
    return (FlockScenario.from_toml if path.suffix == ".toml" else FlockScenario.from_json)(text)


FILES: dict[str, tuple[Callable[[Path], None], Callable[[Path], Any]]] = {
    "policy.npz": (lambda path: policy_file(path, SCENARIO) and None, load_policy),
    "predator.npz": (write_predator, load_policy),
    "run.npz": (partial(save_run, flockesc_env.simulate(SCENARIO, 5.0, seed=1)), load_run),
    "line.npz": (partial(save_run, flockesc_env.simulate_line(LINE, 0.1, seed=1)), load_run),
    "scenario.toml": (lambda path: path.write_text(SCENARIO.to_toml()) and None, read_scenario),
    "scenario.json": (lambda path: path.write_text(SCENARIO.to_json()) and None, read_scenario),
}


def mutated(whole: bytes, draw: random.Random) -> bytes:
    """Return bytes with a flipped bit, a deletion, or a very large number."""
    raw, at = bytearray(whole), draw.randrange(len(whole) or 1)
    kind = draw.randrange(3)
    if kind == 0:
        raw[at : at + 1] = bytes(byte ^ 1 << draw.randrange(8) for byte in raw[at : at + 1])
    elif kind == 1:
        del raw[at : at + draw.randrange(1, 50)]
    else:
        raw[at : at + 4] = b"\xff\xff\xff\x7f"
    return bytes(raw)


def with_mutated_member(whole: bytes, draw: random.Random) -> bytes:
    """Return an archive with valid checksums and one mutated member."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(whole)) as source, zipfile.ZipFile(target, "w") as archive:
        victim = draw.choice(source.namelist())
        for name in source.namelist():
            raw = source.read(name)
            archive.writestr(name, mutated(raw, draw) if name == victim else raw)
    return target.getvalue()


@pytest.mark.parametrize("name", FILES)
def test_mutated_files_are_refused_or_valid(name: str, tmp_path: Path) -> None:
    write, read = FILES[name]
    path, draw, refused = tmp_path / name, random.Random(0), 0  # noqa: S311, no secret
    write(path)
    whole = path.read_bytes()
    tracemalloc.start()
    for number in range(MUTATIONS):
        is_inner = path.suffix == ".npz" and number % 2
        path.write_bytes((with_mutated_member if is_inner else mutated)(whole, draw))
        try:
            read(path)
        except InputError:
            refused += 1
    assert tracemalloc.get_traced_memory()[1] < MEMORY
    tracemalloc.stop()
    assert refused > MUTATIONS / 2


def npy(shape: tuple[int, ...], dtype: str = "<f8", numbers: bytes = b"") -> bytes:
    """Return an npy file with the given header fields, true or false."""
    stream = io.BytesIO()
    header = {"descr": dtype, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_2_0(stream, header)
    return stream.getvalue() + numbers


def archive(members: dict[str, bytes]) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as file:
        for name, raw in members.items():
            file.writestr(name, raw)
    return target.getvalue()


LIES = {
    "a size that is not there": npy((2**40,)),
    "entries of no size": npy((2**40,), "<U0"),
    "objects": npy((1,), "|O", b"12345678"),
    "more than fits": npy((2**22,), numbers=bytes(2**25)),
}


@pytest.mark.parametrize("lie", LIES)
@pytest.mark.parametrize("name", ["policy.npz", "run.npz"])
def test_arrays_with_false_headers_are_refused(name: str, lie: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(archive({f"{key}.npy": LIES[lie] for key in ("header", "parameters", "positions")}))
    tracemalloc.start()
    with pytest.raises(InputError, match=re.escape(str(path))):
        FILES[name][1](path)
    assert tracemalloc.get_traced_memory()[1] < MEMORY
    tracemalloc.stop()


def with_escapes(text: str) -> Iterator[str]:
    """Yield copies of a document in JSON or TOML with one name or value replaced by escape sequences."""
    for token in TOKEN.finditer(text):
        yield text[: token.start()] + json.dumps(ESCAPES) + text[token.end() :]


def hostile_files(name: str, path: Path) -> Iterator[bytes]:
    """Yield copies of a valid file with escape sequences in one place each."""
    FILES[name][0](path)
    whole = io.BytesIO(path.read_bytes())  # the caller overwrites the file
    if path.suffix == ".npz":
        yield ESCAPES.encode()
        yield npz(**{ESCAPES: np.zeros(1)})
        yield archive({"positions.npy": npy((1,)).replace(b"<f8", b"\x1b[J")})
    else:
        yield from map(str.encode, with_escapes(whole.getvalue().decode()))
    arrays = dict(np.load(whole)) if path.suffix == ".npz" else {}
    if "header" in arrays:
        for changed in with_escapes(str(arrays["header"])):
            yield npz(**{**arrays, "header": np.array(changed)})


@pytest.mark.parametrize("name", FILES)
def test_escape_sequences_in_files_do_not_reach_the_terminal(name: str, cli: Cli, tmp_path: Path) -> None:
    path, escaped = tmp_path / f"{ESCAPES} {name}", 0
    contents = list(hostile_files(name, path))
    for raw in contents:
        path.write_bytes(raw)
        ran = cli(*[word.replace("FILE", str(path)) for word in READERS[name.partition(".")[0]]])
        assert ran.code in {Exit.DONE, Exit.FAILED, Exit.REFUSED}
        lines = (ran.out + ran.err).split("\n")
        assert all(line.isprintable() for line in lines), lines
        assert not any(line.startswith("flock.npz: matches") for line in lines)
        escaped += r"\x1b]0;title" in ran.out + ran.err
    assert escaped > len(contents) / 2
