"""Writing of files: every file that the package writes is complete, or stays as it was."""

import errno
import hashlib
import os
import secrets
import stat
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

_SEAL_BYTES = hashlib.sha256().digest_size


@contextmanager
def atomic_write(path: Path, *, durable: bool = True) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces ``path`` when the block ends without an error.

    A file that is replaced keeps its mode, and a symbolic link stays a link. A file that cannot be replaced,
    such as a mounted one, is overwritten at the end. A device or a pipe is written directly. Other programs
    can write to ``name`` of the yielded file. With ``durable`` the call waits for the disk, so that a power
    failure leaves the older file or the new one.

    Raises:
        OSError: if the file cannot be written; ``filename`` is ``path``.
    """
    yield from _writing(path, durable)


def suffix_of(path: str | Path) -> str:
    """Return the suffix of a file's name in lower case, with its dot."""
    return Path(path).suffix.lower()


def check_writable(path: Path) -> None:
    """Check that ``atomic_write`` can write ``path``, and change nothing. Folders may still be missing."""
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


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together; a reader of the first one never finds another with older content.

    All are complete, as ``NAME.new.SUFFIX``, before the first older file is removed and the others are
    replaced. A process that is killed then leaves no first file.

    Raises:
        OSError: if a file cannot be written, for example on a full disk; all stay as they were.
    """
    complete = {path.with_suffix(f".new{path.suffix}"): path for path in contents}
    try:
        for new, path in complete.items():
            with atomic_write(new) as file:
                file.write(contents[path])
    except BaseException:
        for new in complete:
            new.unlink(missing_ok=True)
        raise
    if len(contents) > 1:
        next(iter(contents)).unlink(missing_ok=True)
    for new, path in reversed(complete.items()):
        new.replace(path)


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
    unfinished = target = mode = None
    try:
        with suppress(FileNotFoundError):
            mode = path.stat().st_mode
        if mode is not None:
            if not stat.S_ISREG(mode):
                with path.open("wb") as file:
                    yield file
                return
            path.open("ab").close()  # a file that is read-only stays
        target = path.resolve()
        unfinished = target.with_name(f".{secrets.token_hex(8)}.part")
        with unfinished.open("xb") as file:
            if mode is not None:
                with suppress(OSError):  # some file systems have no modes
                    unfinished.chmod(stat.S_IMODE(mode))
            yield file
            _flush(file, durable)
        try:
            unfinished.replace(target)
        except OSError:  # a mounted file, or another user's in a sticky folder
            if mode is None:
                raise
            with target.open("wb") as file:
                file.write(unfinished.read_bytes())
                _flush(file, durable)
        if durable:
            _sync_folder(target.parent)
    except OSError as error:
        if error.filename is None or str(error.filename) in {str(unfinished), str(path), str(target)}:
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        raise
    finally:
        if unfinished is not None:
            unfinished.unlink(missing_ok=True)


def _flush(file: BinaryIO, durable: bool) -> None:
    """Write buffered bytes; if ``durable``, wait for the disk, unless its file system cannot do so."""
    file.flush()
    if durable:
        try:
            os.fsync(file.fileno())
        except OSError as error:
            if error.errno not in {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP}:
                raise


def _sync_folder(folder: Path) -> None:
    """Write the entries of a folder to the disk, where the system can do so."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
