"""Read archives of arrays (NPZ) from untrusted files: sizes are checked before memory is
allocated.
"""

from io import BytesIO
from math import prod
from typing import IO, Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

KINDS = "biufU"
"""NumPy kinds of numbers and texts that an array may hold; objects, which are pickles, are
refused."""


def read(file: IO[bytes]) -> dict[str, NDArray[Any]]:
    """Read the arrays of an archive that `numpy.savez` wrote, by their names.

    The arrays together take no more memory than the file: compressed members, overlapping members
    and headers that announce more data than follow are refused.

    Args:
        file: open for reading.

    Raises:
        ValueError: such a member, one that is not an array of numbers or texts, or not an archive.
    """
    try:
        size = file.seek(0, 2)
        with ZipFile(file) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > size:
                raise ValueError("expected members that do not overlap")
            if any(member.compress_type != ZIP_STORED for member in members):
                raise ValueError("expected members that are not compressed")
            return {m.filename.removesuffix(".npy"): _array(archive.read(m), size) for m in members}
    except Exception as error:  # zipfile and NumPy raise various errors on damaged bytes
        raise ValueError(f"expected an archive of arrays, got another file: {error}") from error


def _array(content: bytes, most: int) -> NDArray[Any]:
    """Return the array in a member; `most` bounds its dimensions if it is empty."""
    stream = BytesIO(content)
    if npy.read_magic(stream) != (1, 0):
        raise ValueError("expected format 1.0 of NumPy's arrays")
    shape, by_columns, dtype = npy.read_array_header_1_0(stream)
    data = stream.read()
    if dtype.kind not in KINDS or not dtype.itemsize or not all(0 <= n <= most for n in shape):
        raise ValueError("expected an array of numbers or texts")
    if prod(shape) * dtype.itemsize != len(data):
        raise ValueError("expected an array as long as its header says")
    array = np.frombuffer(data, dtype).reshape(shape, order="F" if by_columns else "C")
    return array.astype(dtype.newbyteorder("="))
