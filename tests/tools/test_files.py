"""Files are complete or stay as they were; whether they can be written is known before the work."""

import errno
import os
import re
import stat
import tempfile
from pathlib import Path
from typing import Any

import pytest
from cli_runs import SMALL_FLAGS, Cli, small_files, sweep_flags

from flockesc_env.cli.output import Exit
from flockesc_env.common.files import atomic_write, check_writable, write_together

SIMULATE = ["simulate", "fixed:5", *SMALL_FLAGS]
WATCH = ["watch", "fixed:5", *SMALL_FLAGS]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="links, modes and limits are those of POSIX")
needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")


def write(path: Path, content: bytes = b"new") -> None:
    with atomic_write(path) as file:
        file.write(content)


@pytest.mark.parametrize("is_dangling", [False, True])
def test_a_link_stays_and_its_target_is_replaced(is_dangling: bool, tmp_path: Path) -> None:
    target, link = tmp_path / "elsewhere" / "target", tmp_path / "link"
    target.parent.mkdir()
    if not is_dangling:
        target.write_bytes(b"old")
    link.symlink_to(target)
    write(link)
    assert (link.is_symlink(), target.is_symlink(), target.read_bytes()) == (True, False, b"new")


def test_a_full_disk_leaves_the_older_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    with small_files(1_000), pytest.raises(OSError, match=os.strerror(errno.EFBIG)) as caught:
        write(path, bytes(100_000))
    assert caught.value.filename == str(path)
    assert [(file, file.read_bytes()) for file in tmp_path.iterdir()] == [(path, b"old")]


@pytest.mark.parametrize("calls", range(8))
def test_files_that_belong_together_have_one_age_even_after_a_kill(
    calls: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = paths = [tmp_path / "model.zip", tmp_path / "statistics.pkl"]
    write_together(dict.fromkeys(paths, b"old"))
    with monkeypatch.context() as patch:  # after some calls nothing gets another name
        remaining = iter(range(calls))
        for name in ("replace", "unlink"):
            real = getattr(os, name)
            patch.setattr(os, name, lambda *args, real=real: next(remaining, None) is None or real(*args))
        write_together(dict.fromkeys(paths, b"new"))
    assert first.exists() == (calls < 5 or calls == 7)
    assert not first.exists() or first.read_bytes() == second.read_bytes()
    found = [path.read_bytes() for path in tmp_path.iterdir() if path.suffix != ".part"]
    assert max(found.count(b"old"), found.count(b"new")) >= 2  # nothing is lost
    write_together(dict.fromkeys(paths, b"last"))
    with small_files(1_000), pytest.raises(OSError, match=os.strerror(errno.EFBIG)):
        write_together({first: b"full", second: bytes(100_000)})
    assert [path.read_bytes() for path in paths] == [b"last", b"last"]
    assert {path for path in tmp_path.iterdir() if path.suffix != ".part"} == {*paths}


def test_a_file_is_on_disk_before_it_gets_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power failure leaves the older file or the new one, not an empty one."""
    calls = []

    def sync(descriptor: int, real: Any = os.fsync) -> None:
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        calls.append("folder" if is_folder else f"file of {os.fstat(descriptor).st_size} bytes")
        real(descriptor)

    def replace(source: Path, target: Path, real: Any = Path.replace) -> None:
        calls.append("replace")
        real(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(Path, "replace", replace)
    write(tmp_path / "file")
    assert calls == ["file of 3 bytes", "replace", "folder"]


@pytest.mark.parametrize(
    ("owner", "call", "code"),
    [
        (os, "replace", errno.EBUSY),  # a mounted file
        (os, "replace", errno.EPERM),  # another user's file in a sticky folder
        (os, "fsync", errno.EINVAL),  # a file system of a network or in user space
        (os, "chmod", errno.EPERM),
    ],
)
def test_a_file_that_a_plain_open_can_write_is_written(
    owner: Any, call: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = getattr(owner, call)

    def refuse(*args: Any, **options: Any) -> Any:
        if call != "open" or ("xb" in args and args[0].parent == folder):
            raise OSError(code, os.strerror(code), *args[:1])
        return real(*args, **options)

    folder, link = tmp_path / "folder", tmp_path / "link"
    folder.mkdir()
    (folder / "file").write_bytes(b"older and longer")
    link.symlink_to(folder / "file")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(owner, call, refuse)
    check_writable(link)
    write(link)
    assert {path.name for path in tmp_path.rglob("*")} == {"folder", "file", "link"}
    assert link.read_bytes() == b"new"


def test_a_check_changes_nothing_and_finds_what_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.iterdir())
    for name in ("file", "missing/folder/file", "link"):
        check_writable(tmp_path / name)
    for name in ("x" * 256, "file/inside", "folder"):
        with pytest.raises(OSError, match=re.escape(name)) as caught:
            check_writable(tmp_path / name)
        assert caught.value.errno in {errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR}
        assert caught.value.filename == str(tmp_path / name)
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "file").read_bytes() == b"old"


def never(*_: object, **__: object) -> None:
    raise AssertionError("computed before the output was checked")


@pytest.mark.parametrize(
    ("argv", "suffix"), [(sweep_flags("--backend", "serial"), ".csv"), (SIMULATE, ".npz"), (WATCH, ".html")]
)
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    argv: list[object], suffix: str, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for work in ("sweep.sweep", "sweep.run_all", "runs.run_once", "runs._policy_page"):
        monkeypatch.setattr(f"flockesc_env.cli.{work}", never)
    name = f"{'x' * (256 - len(suffix))}{suffix}"  # one byte more than file systems take
    ran = cli(*argv, "--output", tmp_path / name)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert f"output: expected a file that can be written ({os.strerror(errno.ENAMETOOLONG)}), got" in ran.err


@needs_full
@pytest.mark.parametrize(
    ("argv", "name", "shown"),
    [
        (sweep_flags(), "sweep.csv", "best fixed range"),
        (sweep_flags(), "sweep.parquet", "best fixed range"),
        (sweep_flags("--json"), "sweep.png", '"best_range"'),
        (SIMULATE, "run.npz", "min_mean_distance"),
        (WATCH, "runs.html", ""),
        (WATCH, "runs.mp4", ""),
    ],
)
def test_results_are_shown_even_if_the_disk_is_full(
    argv: list[object], name: str, shown: str, cli: Cli, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.symlink_to("/dev/full")
    ran = cli(*argv, "--output", path)
    assert ran.code == Exit.REFUSED
    assert shown in ran.out
    error = rf"flockesc: error: {re.escape(str(path))}: .*{os.strerror(errno.ENOSPC)}.*\n"
    assert re.fullmatch(error, ran.err.splitlines(keepends=True)[-1])  # notes can stand before it


def test_a_replaced_file_keeps_its_mode_and_a_new_one_has_that_of_the_umask(tmp_path: Path) -> None:
    (tmp_path / "old").write_bytes(b"old")
    (tmp_path / "old").chmod(0o755)
    umask = os.umask(0o027)
    try:
        for name, mode in (("old", 0o755), ("new", 0o640)):
            write(tmp_path / name)
            assert stat.S_IMODE((tmp_path / name).stat().st_mode) == mode
    finally:
        os.umask(umask)
