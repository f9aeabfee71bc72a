"""Child processes in which newer instruction sets of the processor are hidden, from all code or NumPy."""

import json
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from numpy._core import _multiarray_umath

SUPPORT = Path(__file__).parent
UNAVAILABLE = 77  # exit status of masked_cpuid.c if CPUID cannot be intercepted


def each_level(test: Any) -> Any:
    """Decorate a test of (level, has_avx2). Level 2 of x86-64 is without AVX2, level 3 is with it."""
    test = pytest.mark.parametrize(("level", "has_avx2"), [(2, False), (3, True)])(test)
    is_linux = sys.platform == "linux" and platform.machine() == "x86_64"
    return pytest.mark.skipif(not is_linux, reason="only Linux on x86-64 can intercept CPUID")(test)


def run_masked(script: str, level: int, folder: Path) -> Any:
    """Run a script that prints JSON, and return the result. Instruction sets above ``level`` are hidden."""
    compiler, library = shutil.which("cc"), folder / "masked_cpuid.so"
    if not compiler:
        pytest.skip("needs a C compiler: `apt-get install gcc`")
    source = str(SUPPORT / "masked_cpuid.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-Werror", "-o", library, source], check=True)  # noqa: S603
    return _run(script, LD_PRELOAD=str(library), X86_64_LEVEL=str(level))


def run_with_baseline_numpy(script: str) -> Any:
    """Run a script that prints JSON, and return the result. NumPy uses only what every processor has."""
    has = _multiarray_umath.__cpu_features__
    hidden = " ".join(filter(has.get, _multiarray_umath.__cpu_dispatch__))
    return _run(script, NPY_DISABLE_CPU_FEATURES=hidden)


def _run(script: str, **variables: str) -> Any:
    variables["PYTHONPATH"] = os.pathsep.join([str(SUPPORT), *sys.path])
    masked = {**os.environ, **variables}
    child = subprocess.run([sys.executable, "-c", script], env=masked, capture_output=True, text=True)  # noqa: S603
    if child.returncode == UNAVAILABLE:
        pytest.skip("this processor cannot intercept CPUID")
    assert child.returncode == 0, child.stderr
    return json.loads(child.stdout)
