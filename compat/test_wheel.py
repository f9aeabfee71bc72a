"""The wheel: it is installed without the sources and Rust, small, portable, and the package under test."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import files
from pathlib import Path

import flockesc_env

DIST = Path(__file__).parent.parent / "dist"
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


def test_the_wheel_holds_the_package_alone() -> None:
    (wheel,) = DIST.glob(f"*{platform.machine()}.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.partition("/")[0] for name in names} == {
        "flockesc_env",
        f"flockesc_env-{flockesc_env.__version__}.dist-info",
    }
    assert [name for name in names if name.endswith(".so")] == ["flockesc_env/_core.abi3.so"]
    assert any(name.endswith("/LICENSE") for name in names)
    assert "flockesc_env/py.typed" in names
    assert "flockesc_env/watch/engine/flockesc_wasm_bg.wasm" in names
    assert {name for name in names if not name.endswith("RECORD")} <= {
        str(file) for file in files("flockesc-env") or []
    }


def test_pages_contain_the_core(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    subprocess.run([Path(sys.prefix, "bin", "flockesc"), "watch", "--output", page], check=True)  # noqa: S603
    assert "__wbg_get_imports" in page.read_text("utf-8")
