"""MATLAB files of level 4 and 5 (versions 4 to 7) as arrays: what damaged bytes cannot crash.

A level 5 file is a header and elements, each a tag (type, bytes) with its data; a matrix is an
element of elements: flags, dimensions, name, numbers. A level 4 file is a row of matrices, each
with a header of five integers.
Source: The MathWorks, MAT-File Format, 2023.
"""

import zlib
from collections.abc import Iterator
from math import prod

import numpy as np
from numpy.typing import NDArray

NUMBERS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
"""NumPy types by the type of an element."""
OLD_NUMBERS = ("f8", "f4", "i4", "i2", "u2", "u1")
"""The same by the P of level 4."""
MATRIX, COMPRESSED = 14, 15
CLASSES = {1: "a cell array", 2: "a struct", 3: "an object", 4: "text", 5: "a sparse matrix"}
"""Kinds of matrices without plain numbers; those above are numbers."""
HEADER, OLD_HEADER = 128, 20
LARGEST = 2**29
"""Bytes that a compressed element may unfold to."""


def variables(content: bytes) -> dict[str, NDArray[np.generic] | str]:
    """Variables by name: numbers, or in words what else they are.

    Raises:
        NotImplementedError: a file of version 7.3, which is HDF5.
        ValueError: no MATLAB file, or a damaged one.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:HEADER])
    if order is not None:
        if int.from_bytes(content[124:126], "little" if order == "<" else "big") >> 8 == 2:
            raise NotImplementedError
        return dict(_level_5(content[HEADER:], order))
    if 0 not in content[:4]:
        raise ValueError("the first bytes are those of no such file")
    return dict(_level_4(content))


def _level_5(data: bytes, order: str) -> Iterator[tuple[str, NDArray[np.generic] | str]]:
    for kind, body in _elements(data, order):
        inner = _elements(_unfolded(body), order) if kind == COMPRESSED else ((kind, body),)
        yield from (_matrix(part, order) for what, part in inner if what == MATRIX)


def _unfolded(data: bytes) -> bytes:
    try:
        return zlib.decompressobj().decompress(data, LARGEST)
    except zlib.error as error:
        raise ValueError(f"a compressed variable is damaged ({error})") from None


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Type and data of the elements, one after the other."""
    at = 0
    while at < len(data):
        if at + 8 > len(data):
            raise ValueError("it ends inside a tag")
        kind, size = (int(x) for x in np.frombuffer(data, f"{order}u4", 2, at))
        short = kind >> 16
        start = at + (4 if short else 8)
        kind, size = (kind & 0xFFFF, short) if short else (kind, size)
        if start + size > len(data) or (short and size > 4):
            raise ValueError("an element is longer than what is left of it")
        yield kind, data[start : start + size]
        at = at + 8 if short else start + size
        if kind != COMPRESSED:
            at = -(-at // 8) * 8


def _matrix(data: bytes, order: str) -> tuple[str, NDArray[np.generic] | str]:
    parts = list(_elements(data, order))
    if len(parts) < 3:
        raise ValueError("a variable has no dimensions or no name")
    flags, shape = (_numbers(*part, order) for part in parts[:2])
    name = parts[2][1].decode("latin-1")
    if not flags.size or flags.dtype.kind not in "iu" or shape.dtype.kind not in "iu":
        raise ValueError(f"variable {name!r} does not say what it is")
    kind = int(flags[0]) & 0xFF
    if kind in CLASSES or len(parts) < 4:
        return name, CLASSES.get(kind, "nothing")
    if int(flags[0]) & 0x800:
        return name, "a matrix of complex numbers"
    return name, _shaped(name, _numbers(*parts[3], order), [int(n) for n in shape])


def _numbers(kind: int, data: bytes, order: str) -> NDArray[np.generic]:
    code = NUMBERS.get(kind)
    if code is None or len(data) % int(code[1]):
        raise ValueError(f"an element of numbers is of type {kind} with {len(data)} bytes")
    return np.frombuffer(data, f"{order}{code}")


def _shaped(name: str, values: NDArray[np.generic], shape: list[int]) -> NDArray[np.generic]:
    if min(shape, default=-1) < 0 or prod(shape) != values.size:
        raise ValueError(f"variable {name!r} has {values.size} numbers for the shape {shape}")
    return values.reshape(shape, order="F")


def _level_4(data: bytes) -> Iterator[tuple[str, NDArray[np.generic] | str]]:
    at = 0
    while at < len(data):
        if at + OLD_HEADER > len(data):
            raise ValueError("it ends inside the header of a variable")
        order = "<" if 0 <= int(np.frombuffer(data, "<i4", 1, at)[0]) < 5000 else ">"
        head = [int(x) for x in np.frombuffer(data, f"{order}i4", 5, at)]
        (kind, rows, columns, imaginary, length), start = head, at + OLD_HEADER
        machine, rest = divmod(kind, 1000)
        known = machine == (order == ">") and rest // 100 == 0 and rest // 10 < len(OLD_NUMBERS)
        if not known or min(rows, columns) < 0 or imaginary not in (0, 1) or length < 2:
            raise ValueError("the header of a variable is that of no such file")
        code = OLD_NUMBERS[rest // 10]
        name = data[start : start + length - 1].decode("latin-1")
        start += length
        size = rows * columns * int(code[1])
        if start + size * (1 + imaginary) > len(data):
            raise ValueError(f"variable {name!r} is longer than what is left of it")
        if rest % 10 or imaginary:
            yield name, "text, sparse or complex"
        else:
            numbers = np.frombuffer(data, f"{order}{code}", rows * columns, start)
            yield name, _shaped(name, numbers, [rows, columns])
        at = start + size * (1 + imaginary)
