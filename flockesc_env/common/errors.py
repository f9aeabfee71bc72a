"""Errors of the package: inputs that were refused, and calls at the wrong moment."""

from gymnasium.error import ResetNeeded

_LONGEST = 300
"""Characters of what came that an error shows."""


def shown(value: object) -> str:
    """Return what came as an error shows it: its ``repr``, cut off where it is long."""
    try:
        return _cut(repr(value))
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists in lists
        return f"something too long to show, of type {type(value).__name__}"


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} .."


class FlockescError(Exception):
    """Base class of the errors that this package raises."""


class InputError(FlockescError, ValueError):
    """An input that was refused; nothing has changed.

    Attributes:
        field: name or path of what was refused, for example ``predators[0].pure_pursuit.max_turn_rate``.
        expected: what would have been accepted.
        given: what came, as text.
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
    """A scenario does not fit its schema or bounds."""


class OptionError(InputError):
    """An option of an environment is unknown or out of bounds."""


class ArgumentError(InputError):
    """An argument of a call, or an entry of a ``reset`` option, has the wrong type, shape or value."""


class ActionError(ArgumentError):
    """An action is outside of the action space or addresses an unknown agent."""


class RecordError(InputError):
    """A file does not hold what was expected of it."""


class EpisodeError(FlockescError, RuntimeError):
    """A call came at the wrong moment, for example during another call of the same environment."""


class ResetNeededError(EpisodeError, ResetNeeded):
    """A call came before ``reset``, or after the end of an episode."""
