"""Short signatures in the API reference. Load this extension before ``flockesc_env`` is imported."""

from typing import Any, Generic, TypeVar

import numpy.typing
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

ScalarType = TypeVar("ScalarType")


class NDArray(Generic[ScalarType]):
    """Replaces ``numpy.typing.NDArray``, an alias, so that signatures show its name."""

    __module__ = "numpy.typing"


def setup(app: Sphinx) -> dict[str, Any]:
    """Shorten types, overloads, and classes that only this package constructs."""
    app.setup_extension("sphinx.ext.autodoc")
    numpy.typing.NDArray = NDArray
    numpy.typing.ArrayLike = type("ArrayLike", (), {"__module__": "numpy.typing"})
    ModuleAnalyzer.overloads = property(lambda _: {}, lambda _, __: None)  # one signature per function
    app.connect("autodoc-process-signature", _without_constructor)
    return {"parallel_read_safe": True}


def _without_constructor(
    _app: Sphinx, what: str, _name: str, _obj: Any, options: Any, *_: Any
) -> tuple[str, None] | None:
    """Hide the signature of a class whose directive excludes ``__init__``."""
    is_hidden = what == "class" and "__init__" in (options.exclude_members or ())
    return ("", None) if is_hidden else None
