"""Configuration of all tests: the path of helper modules, and hypothesis profiles."""

import os
import sys
from pathlib import Path

from hypothesis import settings

# Makes support/ importable. The repository root stays off the path, so that the installed
# package is tested instead of the source tree.
sys.path.append(str(Path(__file__).parent / "support"))

# SDL opens no windows, on machines with and without a display.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# Workers share the cores; several torch threads in each make training tests four times slower.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# No deadline, because machines are shared. Derandomized, so that only code changes make a test fail.
settings.register_profile("suite", deadline=None, derandomize=True, database=None, print_blob=True)
settings.load_profile("suite")
