"""The wheel: it is installed without the sources and Rust, small, portable, and the package under test."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import files
from pathlib import Path

import pytest

import flockesc_env

ROOT = Path(__file__).parent.parent
DIST = ROOT / "dist"
COMPILED = {".pyc", ".pyd", ".so"}
PARTS = {
    "flockesc_env/policies/trained/per-agent-visible/search.npz",
    *(f"flockesc_env/watch/engine/flockesc_wasm{end}" for end in (".js", "_bg.wasm")),
}
"""Files that a wheel holds, also if the checkout lacks them."""
LARGEST = 5_000_000
"""Largest size of a wheel in bytes."""


def test_the_package_is_the_installed_one() -> None:
    assert Path(flockesc_env.__file__).is_relative_to(sys.prefix)
    assert shutil.which("cargo") is None
    assert shutil.which("rustc") is None


def test_the_wheel_is_portable_and_small() -> None:
    (wheel,) = DIST.glob(f"*{platform.machine()}.whl")
    assert f"-{flockesc_env.__version__}-cp311-abi3-manylinux2014_" in wheel.name
    assert wheel.stat().st_size < LARGEST


@pytest.mark.parametrize("wheel", sorted(DIST.glob("*.whl")), ids=lambda wheel: wheel.stem)
def test_wheels_hold_the_package_alone(wheel: Path) -> None:
    """Its sources with policies and page, the core for web pages, the compiled core, and metadata."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    paths = {path for path in (ROOT / "flockesc_env").rglob("*") if path.suffix not in COMPILED | {""}}
    held = {path.relative_to(ROOT).as_posix() for path in paths} | PARTS
    metadata = {
        name for name in names if name.startswith(f"flockesc_env-{flockesc_env.__version__}.dist-info/")
    }
    (core,) = names - metadata - held
    assert core.startswith("flockesc_env/_core.")
    assert held <= names
    assert any(name.endswith("/LICENSE") for name in metadata)


def test_all_of_the_wheel_is_installed() -> None:
    (wheel,) = DIST.glob(f"*{platform.machine()}.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not name.endswith("RECORD")}
    assert names <= {str(file) for file in files("flockesc-env") or []}


def test_pages_contain_the_core(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    subprocess.run([Path(sys.prefix, "bin", "flockesc"), "watch", "--output", page], check=True)  # noqa: S603
    assert "__wbg_get_imports" in page.read_text("utf-8")
