"""Exceptions of the package.

Errors about values read ``field: expected X, got Y``. Errors about the state of an environment are sentences.
Messages contain strings from files, so control characters in them are escaped.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches

from gymnasium.error import ResetNeeded

_MAX_CHARACTERS = 300
"""Values in error messages are cut after this many characters."""

_MAX_FIELD = 10 * _MAX_CHARACTERS
"""Fields are cut after this many characters. They may contain a path."""


def printable(text: str) -> str:
    """Return a text with line breaks, control characters and invisible characters as backslash escapes.

    A terminal would execute the escape sequences in a string from a file, for example move its cursor.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shown(value: object, length: int = _MAX_CHARACTERS) -> str:
    """Return the ``repr`` of a value, cut after ``length`` characters."""
    try:
        return _cut(" ".join(map(str.strip, repr(value).split("\n"))), length)
    except (ValueError, RecursionError):  # an integer of thousands of digits, or recursive lists
        return f"a {type(value).__name__} too long to show"


def shown_name(name: object, known: Iterable[str]) -> str:
    """Return the ``repr`` of an unknown name, followed by the most similar known names if there are any."""
    nearest = get_close_matches(name, known) if isinstance(name, str) else []
    listed = " or ".join(filter(None, [", ".join(nearest[:-1]), *nearest[-1:]]))
    return f"{shown(name)} (did you mean {listed}?)" if nearest else shown(name)


def _cut(text: str, length: int = _MAX_CHARACTERS) -> str:
    """Return a text in one printable line, cut after ``length`` characters."""
    return printable(text if len(text) <= length else f"{text[:length]} ..")


class FlockescError(Exception):
    """Base class of the package's exceptions. A call that raises one leaves everything unchanged."""

    def __str__(self) -> str:
        return "\n".join(map(printable, super().__str__().split("\n")))


class InputError(FlockescError, ValueError):
    """An input has the wrong type, shape or value.

    Every function and class of the package raises it, before anything has changed. "Raises" in a docstring
    names only errors that do not follow from the description of the arguments.

    Attributes:
        field: name or path of the rejected value, for example ``predators[0].pure_pursuit.max_turn_rate``.
        expected: description of the values that are accepted.
        given: the rejected value, as a string.
    """

    def __init__(self, field: str, expected: str, given: object) -> None:
        try:
            self.given = _cut(str(given))
        except (ValueError, RecursionError):
            self.given = shown(given)
        self.field = _cut(field, _MAX_FIELD)
        self.expected = printable(expected)
        super().__init__(self.field, self.expected, self.given)

    def __str__(self) -> str:
        return f"{self.field}: expected {self.expected}, got {self.given}"


@contextmanager
def errors_at(place: str) -> Iterator[None]:
    """Put ``place`` before the field of an ``InputError`` that the block raises."""
    try:
        yield
    except InputError as error:
        raise InputError(place + error.field, error.expected, error.given) from None


class JobError(FlockescError, RuntimeError):
    """Jobs failed, or their results were lost. The results of all other jobs are kept."""


class ResetNeededError(FlockescError, ResetNeeded):
    """A method was called before ``reset``, or after the end of the episode."""
