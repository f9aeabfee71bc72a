"""The package's exceptions: each names a field, what was expected and what was given."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from gymnasium.error import ResetNeeded

_LONGEST = 300
"""Characters of a value that an error shows."""


def shown(value: object) -> str:
    """Return the ``repr`` of a value, cut after 300 characters."""
    try:
        return _cut(repr(value))
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists in lists
        return f"something too long to show, of type {type(value).__name__}"


def shown_name(name: object, known: Iterable[str]) -> str:
    """Return an unknown name as an error shows it, with the nearest known name if one is similar."""
    nearest = get_close_matches(name, known, n=1) if isinstance(name, str) else []
    return f"{shown(name)} (did you mean {nearest[0]}?)" if nearest else shown(name)


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} .."


class FlockescError(Exception):
    """Base class of the package's exceptions. The call that raises one has changed nothing."""


class InputError(FlockescError, ValueError):
    """An input that was refused.

    Attributes:
        field: name or path of the rejected value, for example ``predators[0].pure_pursuit.max_turn_rate``.
        expected: what would have been accepted.
        given: the rejected value, as text.
    """

    def __init__(self, field: str, expected: str, given: object) -> None:
        try:
            self.given = _cut(str(given))
        except (ValueError, RecursionError):
            self.given = shown(given)
        super().__init__(field, expected, self.given)
        self.field = field
        self.expected = expected

    def __str__(self) -> str:
        return f"{self.field}: expected {self.expected}, got {self.given}"


class ScenarioError(InputError):
    """A field of a scenario is unknown, has the wrong type or is out of bounds."""


class OptionError(InputError):
    """An option of an environment is unknown, has the wrong type or is out of bounds."""


class ArgumentError(InputError):
    """An argument of a call, or an entry of a ``reset`` option, has the wrong type, shape or value."""


class ActionError(ArgumentError):
    """An action is outside the action space, or belongs to an unknown agent."""


class RecordError(InputError):
    """A file is damaged or does not contain what the call reads."""


class JobError(FlockescError, RuntimeError):
    """Jobs failed, or their results were lost. The results of all other jobs are kept."""


class EpisodeError(FlockescError, RuntimeError):
    """A call came at the wrong moment, for example during another call of the same environment."""


class ResetNeededError(EpisodeError, ResetNeeded):
    """A call came before ``reset``, or after the end of an episode."""
