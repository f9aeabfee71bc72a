"""Array files (npz, npy) from untrusted sources: nothing is executed, sizes are checked before reading."""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from flockesc_env.common.errors import RecordError
from flockesc_env.common.files import atomic_write

_HEADER = "header"
_LARGEST = 2**26
_LARGEST_RATIO = 256
"""Limits of an archive's unpacked size: 64 MiB plus 256 times its packed size."""

_HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def write_document(path: Path, header: dict[str, Any], arrays: Mapping[str, Any]) -> None:
    """Write a JSON object and arrays to an npz file; replace an older file only when complete."""
    with atomic_write(path) as file:
        np.savez_compressed(file, header=np.array(json.dumps(header)), **arrays)


def read_document(path: Path, expected: str) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the JSON object and the arrays that ``write_document`` wrote.

    Args:
        path: the file.
        expected: the expected kind of file, for errors.

    Raises:
        FileNotFoundError: if there is no such file.
        RecordError: naming the file or, if only that is damaged, ``header``.
    """
    arrays = read_npz(path, expected)
    text = str(arrays.pop(_HEADER, np.array(""))[()])
    try:
        return msgspec.json.decode(text, type=dict[str, Any]), arrays
    except (ValueError, RecursionError) as error:
        raise RecordError(_HEADER, "a JSON object", error) from None


def read_npz(path: Path, expected: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz file by name.

    Raises:
        FileNotFoundError: if there is no such file.
        RecordError: if it is damaged, of another kind or unpacks to far more than its size.
    """
    raw = path.read_bytes()
    try:
        with zipfile.ZipFile(BytesIO(raw)) as archive:
            members = archive.infolist()
            size, largest = sum(member.file_size for member in members), _largest(raw)
            if size > largest:
                raise RecordError(str(path), f"at most {largest} bytes of arrays", size)
            return {_name(member): _array(_unpacked(archive, member)) for member in members}
    except RecordError:
        raise
    except Exception as error:  # zipfile, its decompressors and NumPy raise many kinds
        raise RecordError(str(path), expected, repr(error)) from None


def read_npy(path: Path, expected: str) -> NDArray[Any]:
    """Return the array of an npy file.

    Raises:
        FileNotFoundError: if there is no such file.
        RecordError: if it is damaged or of another kind.
    """
    raw = path.read_bytes()
    try:
        return _array(raw)
    except Exception as error:  # as above
        raise RecordError(str(path), expected, repr(error)) from None


def _largest(raw: bytes) -> int:
    return _LARGEST + _LARGEST_RATIO * len(raw)


def _name(member: zipfile.ZipInfo) -> str:
    if not member.filename.endswith(".npy"):
        raise ValueError(f"{member.filename!r} is no array")
    return member.filename.removesuffix(".npy")


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    with archive.open(member) as file:
        return file.read(member.file_size)  # without a size it would unpack everything


def _array(raw: bytes) -> NDArray[Any]:
    """Return the array of an npy file; its size must be the one in its header."""
    stream = BytesIO(raw)
    version = npy.read_magic(stream)
    if version not in _HEADER_READERS:
        raise ValueError(f"version {version} of the format")
    shape, is_fortran, dtype = _HEADER_READERS[version](stream)
    said, there = math.prod(shape) * dtype.itemsize, len(raw) - stream.tell()
    if dtype.hasobject or min(shape, default=0) < 0 or said != there:
        raise ValueError(f"{there} bytes for {dtype} of shape {shape}")
    flat = np.frombuffer(bytearray(raw), dtype, offset=stream.tell()) if there else np.empty(0, dtype)
    return flat.reshape(shape, order="F" if is_fortran else "C")
