"""Files are written whole or not at all."""

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def written(path: str | Path) -> Generator[Path, None, None]:
    """A temporary path beside `path` that takes its name when the block ends without error.

    The folder is made where it is missing. After an error or an interrupt the old file, if any, is
    as it was and nothing is left behind.

    Raises:
        ValueError: the path is a folder or a device, or its folder cannot be made or written.
    """
    target = Path(path).resolve()  # a link stays a link to the new file
    try:
        if target.exists() and not target.is_file():
            kind = "a folder" if target.is_dir() else "a device"
            raise ValueError(f"output '{path}': expected a file name, got {kind}")
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(
            prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent
        )
    except OSError as error:
        raise ValueError(
            f"output '{path}': expected a writable place, got {error.strerror}"
        ) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(target)
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def write_text(path: str | Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all."""
    with written(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
