"""The colors of every picture: pygame's, the watch page's and the figures of Matplotlib.

Interaction ranges are viridis, learned policies purple, fixed ranges gray and predators vermilion. Components
are muted, so that no component looks like a predator. The colors of the five largest components are as easy
to tell apart with any kind of color blindness as those of Okabe and Ito.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Palette:
    """Colors as ``"#rrggbb"``.

    Attributes:
        page: background of a page.
        ground: background of a flock.
        line: borders between parts.
        frame: axes, and crosses where agents were caught.
        grid: grid lines.
        muted: text of less weight.
        ink: text.
        accent: controls, and a quantity that belongs to no policy.
        predator: vermilion.
        components: the largest components.
        other: a component that is smaller than these.
        alone: an agent without neighbors.
        fixed: a fixed range.
        learned: a learned policy.
        others: other policies.
        ranges: interaction ranges from 0 to the largest, in equal steps: viridis, with a darker yellow on a
            light ground and a lighter blue on a dark one.
    """

    page: str
    ground: str
    line: str
    frame: str
    grid: str
    muted: str
    ink: str
    accent: str
    predator: str
    components: tuple[str, ...]
    other: str
    alone: str
    fixed: str
    learned: str
    others: tuple[str, ...]
    ranges: tuple[str, ...]


LIGHT = Palette(
    page="#ffffff",
    ground="#fafaf8",
    line="#e2e2dd",
    frame="#bec1c6",
    grid="#ecece7",
    muted="#6b6f76",
    ink="#1d2129",
    accent="#0072b2",
    predator="#d55e00",
    components=("#3073a5", "#ddb66a", "#934b63", "#7ed3a6", "#6b571f"),
    other="#4b5058",
    alone="#949aa3",
    fixed="#3f4652",
    learned="#7c3aed",
    others=("#0d9488", "#0072b2", "#be185d", "#4d7c0f", "#b45309"),
    ranges=("#440154", "#3b528b", "#21918c", "#4fb95a", "#b7b71e"),
)

DARK = Palette(
    page="#15171b",
    ground="#1b1e23",
    line="#32363d",
    frame="#4a4f58",
    grid="#292d33",
    muted="#9aa0a9",
    ink="#e8eaed",
    accent="#56b4e9",
    predator="#ff7a1a",
    components=("#97b8fc", "#ffd791", "#e399c7", "#b3be8d", "#a1ebf7"),
    other="#b9bec6",
    alone="#858c96",
    fixed="#c9ced6",
    learned="#a78bfa",
    others=("#2dd4bf", "#56b4e9", "#f472b6", "#a3e635", "#f0a04b"),
    ranges=("#8a63d8", "#4f8fd6", "#27b5a5", "#7ad95b", "#fde725"),
)
