"""Tests of minutes: ``python -m pytest soak``. They use the helpers of the others."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tests"))
