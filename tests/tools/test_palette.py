"""One palette for all pictures: no other module names a color."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flockesc_env.render.palette import DARK, LIGHT

ROOT = Path(__file__).parents[2]
DRAWING = sorted(
    path
    for folder in ("flockesc_env/render", "flockesc_env/watch", "studies", "training", "benchmarks")
    for path in (ROOT / folder).rglob("*.py")
    if path.name != "palette.py"
)
COLOR = re.compile(r"#[0-9a-fA-F]{6}\b|\btab:\w+|[\"'](red|blue|orange|green|purple|black|gray|grey)[\"']")


def test_colors_come_from_the_palette() -> None:
    assert not [path for path in DRAWING if COLOR.search(path.read_text())]


def channels(color: str) -> tuple[float, ...]:
    values = [byte / 255 for byte in bytes.fromhex(color[1:])]
    return tuple(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values)


@pytest.mark.parametrize("palette", [LIGHT, DARK])
def test_concepts_stand_out_from_the_page(palette: object) -> None:
    """At least 3 : 1, as WCAG asks of graphics."""

    def luminance(name: str) -> float:
        red, green, blue = channels(getattr(palette, name))
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    for name in ("predator", "fixed", "learned", "accent", "ink"):
        bright, dark = sorted((luminance(name), luminance("page")), reverse=True)
        assert (bright + 0.05) / (dark + 0.05) >= 3, name
