"""Reading and writing of files of arrays (npz), tables (Parquet, CSV) and figures of results.

Reading executes no code from the file (no pickle) and checks the sizes in headers before it loads arrays.
Damaged files raise ``InputError``; ``expected`` is the expected kind of file in its message.
"""

import json
import math
import shlex
import sys
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, cast

import msgspec
import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from flockesc_env._core import __version__
from flockesc_env.common.checks import parse_json
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import figure_style
from flockesc_env.common.files import atomic_write, suffix_of

if TYPE_CHECKING:  # of the extra analysis
    import polars as pl
    from matplotlib.figure import Figure

TABLES: Final = (".parquet", ".csv")
PICTURES: Final = (".png", ".svg", ".pdf")
_HEADER = "header"
_KINDS = {"a policy": {_HEADER, "parameters"}, "a recorded run": {_HEADER, "num_components"}}
"""Arrays of each kind of npz file."""

_HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def write_document(path: Path, header: dict[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write a JSON object and arrays to an npz file; an existing file is replaced atomically."""
    write_npz(path, {_HEADER: np.array(json.dumps(header)), **arrays})


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays to an npz file; an existing file is replaced atomically."""
    with atomic_write(path) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def write_table(table: "pl.DataFrame", path: Path, metadata: dict[str, str] | None = None) -> None:
    """Write a table to a Parquet file; an existing file is replaced atomically."""
    packed = BytesIO()  # polars raises its own errors for a full disk
    table.write_parquet(packed, metadata=metadata)
    with atomic_write(path) as file:
        file.write(packed.getbuffer())


def command_line() -> str:
    """Return the command of this process, without the folder of its program."""
    return shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])


def origin(result: Any) -> dict[str, str]:
    """Return where a result comes from: version, command, scenario (JSON), seeds (START:STOP or a list)."""
    given, scenario = result.seeds.tolist(), result.scenario.to_json()
    is_range = given == list(range(given[0], given[0] + len(given)))
    text = f"{given[0]}:{given[-1] + 1}" if is_range else ",".join(map(str, given))
    return {"version": __version__, "command": command_line(), "scenario": scenario, "seeds": text}


def write_result(path: Path, result: "pl.DataFrame | Figure", metadata: dict[str, str]) -> None:
    """Write a table (``TABLES``) or a figure (``PICTURES``) with its ``origin``; replace it atomically.

    In CSV files it is a first line, "# " and JSON, and in figures JSON as Description (in PDF: Subject).
    """
    suffix, packed, note = suffix_of(path), BytesIO(), json.dumps(metadata)
    if suffix == ".parquet":
        cast("pl.DataFrame", result).write_parquet(packed, metadata=metadata)
    elif suffix == ".csv":
        packed.write(f"# {note}\n".encode())
        cast("pl.DataFrame", result).write_csv(packed)
    else:
        entry = "Subject" if suffix == ".pdf" else "Description"
        with figure_style():
            cast("Figure", result).savefig(packed, format=suffix[1:], dpi=150, metadata={entry: note})
    with atomic_write(path) as file:
        file.write(packed.getbuffer())


def read_document(
    path: Path, expected: str, array: str, raw: bytes | None = None
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the JSON object and the arrays that ``write_document`` wrote; ``raw``: see ``read_npz``.

    Every file of the kind ``expected`` contains the array ``array``.
    """
    arrays = read_npz(path, expected, raw)
    if not {_HEADER, array} <= arrays.keys():
        kinds = (kind for kind, names in _KINDS.items() if names <= arrays.keys())
        raise InputError(str(path), expected, next(kinds, f"the arrays {', '.join(arrays) or 'none'}"))
    text = str(arrays.pop(_HEADER)[()])
    try:
        parse_json(text)  # rejects duplicate keys; msgspec rejects NaN and invalid Unicode
        return msgspec.json.decode(text, type=dict[str, Any]), arrays
    except (ValueError, RecursionError) as error:
        raise InputError(_HEADER, "a JSON object", error) from None


def read_npz(path: Path, expected: str, raw: bytes | None = None) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz file by name; ``raw``: the file's bytes, if they were read before."""
    raw = path.read_bytes() if raw is None else raw
    arrays = {}
    try:
        with zipfile.ZipFile(BytesIO(raw)) as archive:
            size, max_size = sum(member.file_size for member in archive.infolist()), 2**26 + 256 * len(raw)
            if size > max_size:
                raise ValueError(f"{size} bytes of arrays, more than {max_size}")
            for member in archive.infolist():
                with archive.open(member) as file:
                    arrays[member.filename.removesuffix(".npy")] = _array(file, member.file_size)
    except Exception as error:  # zipfile, its decompressors and NumPy raise exceptions of many types
        raise InputError(str(path), expected, repr(error)) from None
    return arrays


def _array(file: IO[bytes], num_bytes: int) -> NDArray[Any]:
    """Return the array of an npy file, whose size in the header is at most ``num_bytes``."""
    shape, _, dtype = _HEADER_READERS[npy.read_magic(file)](file)
    if math.prod(shape) * max(dtype.itemsize, 1) > num_bytes:
        raise ValueError(f"{dtype} of shape {shape} in {num_bytes} bytes")
    file.seek(0)
    array: NDArray[Any] = np.load(file, allow_pickle=False)
    return array
