"""Checks of committed pages."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flockesc_env.common import stats

INTERVAL = re.compile(r"\[[-+]?[\d,.]+, [-+]?[\d,.]+\]|± [\d.]+")


def without_intervals(text: str) -> str:
    return INTERVAL.sub("[]", text)


def skip_bootstraps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give every interval the width 0. Bootstraps take most of the time of a page."""

    def bootstrap(sample: Any, statistic: Any, **_: Any) -> Any:
        value = statistic(*(np.asarray(values)[None] for values in sample), axis=-1)[..., 0]
        return SimpleNamespace(confidence_interval=SimpleNamespace(low=value, high=value))

    monkeypatch.setattr(stats, "bootstrap", bootstrap)
