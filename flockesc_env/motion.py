"""How agents move: the laws by which forces set velocities (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Inertial:
    """Forces change velocities, by Newton's law, as in the paper."""

    kind: ClassVar[str] = "inertial"


@dataclass(frozen=True)
class Vicsek:
    """Forces are the new headings at once, whatever the masses: the Vicsek model, at constant speed."""

    kind: ClassVar[str] = "vicsek"


Motion = Inertial | Vicsek
