"""How results show themselves: a short ``repr``, and HTML in notebooks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import singledispatch


@singledispatch
def to_html(_result: object) -> str | None:
    """Return a result as HTML; ``None``: notebooks show the ``repr``. See ``flockesc_env.notebook``."""
    return None


class Displayed(ABC):
    """Base class of results."""

    @abstractmethod
    def _summary(self) -> dict[str, object]:
        """Return what the ``repr`` shows, by name."""

    def __repr__(self) -> str:
        facts = (
            f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}"
            for name, value in self._summary().items()
        )
        return f"{type(self).__name__}({', '.join(facts)})"

    def _repr_html_(self) -> str | None:
        return to_html(self)
