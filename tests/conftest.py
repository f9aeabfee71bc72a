"""What all tests share: where helper modules lie, and how hypothesis runs."""

import os
import sys
from pathlib import Path

from hypothesis import settings

# Helpers in support/ are importable; the repository root stays off the path, so that the installed
# package is tested and not the source tree.
sys.path.append(str(Path(__file__).parent / "support"))

# Windows open nowhere, on machines with and without a display.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# Workers share the cores: more threads of torch in each make tests of training four times slower.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# No deadline: machines are shared. Derandomized: a red run means that the code has changed.
settings.register_profile("suite", deadline=None, derandomize=True, database=None, print_blob=True)
settings.load_profile("suite")
