"""Children that see a lesser processor: CPUID is hidden from them (``masked_cpuid.c``)."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SUPPORT = Path(__file__).parent
UNAVAILABLE = 77  # masked_cpuid.c


def LEVELS(test: Any) -> Any:  # noqa: N802, a mark
    """Run a test of (level, has_avx2): level 2 of x86-64 is below AVX2, 3 has it."""
    test = pytest.mark.parametrize(("level", "has_avx2"), [(2, False), (3, True)])(test)
    is_linux = sys.platform == "linux" and platform.machine() == "x86_64"
    return pytest.mark.skipif(not is_linux, reason="CPUID is hidden by a trick of Linux")(test)


def run_masked(script: str, level: int, folder: Path) -> Any:
    """Run a script that prints JSON; what this processor has beyond ``level`` is hidden from it."""
    compiler, library = shutil.which("cc"), folder / "masked_cpuid.so"
    assert compiler, "Rust needs a C compiler, too"
    source = str(SUPPORT / "masked_cpuid.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-Werror", "-o", library, source], check=True)  # noqa: S603
    path = os.pathsep.join([str(SUPPORT), *sys.path])
    masked = {**os.environ, "LD_PRELOAD": str(library), "X86_64_LEVEL": str(level), "PYTHONPATH": path}
    child = subprocess.run([sys.executable, "-c", script], env=masked, capture_output=True, text=True)  # noqa: S603
    if child.returncode == UNAVAILABLE:
        pytest.skip("this processor cannot make CPUID fault")
    assert child.returncode == 0, child.stderr
    return json.loads(child.stdout)
