"""Writing of files: every file that the package writes is complete, or stays as it was."""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

_SEAL_BYTES = hashlib.sha256().digest_size


@contextmanager
def atomic_write(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces ``path`` when the block ends without an error.

    A file that is replaced keeps its mode, and a symbolic link stays a link. A device or a pipe is written
    directly. Other programs can write to ``name`` of the yielded file. With ``durable`` the call waits for
    the disk, so that a power failure leaves the older file or the new one.

    Raises:
        OSError: if the file cannot be written; ``filename`` is ``path``.
    """
    yield from _writing(path, durable)


def suffix_of(path: str | Path) -> str:
    """Return the suffix of a file's name in lower case, with its dot."""
    return Path(path).suffix.lower()


def check_writable(path: Path) -> None:
    """Check that ``atomic_write`` can open ``path``, and change nothing. Folders may still be missing."""
    nearest = path
    while not nearest.parent.exists():
        nearest = nearest.parent
    if not nearest.is_fifo():  # opening a pipe waits for its reader
        with closing(_writing(nearest, durable=False)) as trial:
            next(trial)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8."""
    with atomic_write(path) as file:
        file.write(text.encode())


def write_sealed(path: Path, owner: str, content: bytes, *, durable: bool = True) -> None:
    """Write bytes, followed by a hash of the bytes and of their owner."""
    with atomic_write(path, durable=durable) as file:
        file.write(content)
        file.write(_seal(owner, content))


def read_sealed(path: Path, owner: str) -> bytes | None:
    """Return the bytes that ``write_sealed`` wrote, or None if they are damaged or have another owner."""
    raw = path.read_bytes()
    content, seal = raw[:-_SEAL_BYTES], raw[-_SEAL_BYTES:]
    return content if seal == _seal(owner, content) else None


def _seal(owner: str, content: bytes) -> bytes:
    return hashlib.sha256(hashlib.sha256(owner.encode()).digest() + content).digest()


def _writing(path: Path, durable: bool) -> Generator[BinaryIO, None, None]:
    unfinished = older = None
    try:
        with suppress(FileNotFoundError):
            older = path.stat()
        if older is not None and not stat.S_ISREG(older.st_mode):
            with path.open("wb") as file:
                yield file
            return
        target = path.resolve()
        unfinished = target.with_name(f".{secrets.token_hex(8)}.part")
        with unfinished.open("xb") as file:
            if older is not None:
                unfinished.chmod(stat.S_IMODE(older.st_mode))
            yield file
            file.flush()
            if durable:
                os.fsync(file.fileno())
        unfinished.replace(target)
        if durable:
            _sync_folder(target.parent)
    except OSError as error:
        if error.filename is None or str(error.filename) in {str(unfinished), str(path)}:
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        raise
    finally:
        if unfinished is not None:
            unfinished.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    """Write the entries of a folder to the disk, where the system can do so."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
