"""Reader of MATLAB files of level 4 and 5 (versions 4 to 7), safe for damaged files.

A level 5 file is a header and elements, each a tag (type, bytes) with its data; a matrix is an
element of elements: flags, dimensions, name, numbers; of a struct its fields, of a cell array its
cells are matrices again. A level 4 file is a row of matrices, each with a header of five integers.
`scipy.io.loadmat` reads the same but ends the process by a segmentation fault on damaged files.
Source: The MathWorks, MAT-File Format, 2023.
"""

import zlib
from collections.abc import Iterator
from math import prod
from typing import Any

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
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16-le", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
"""Encodings by the type of an element of text."""
MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, OBJECT, TEXT, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
CLASSES = {
    OBJECT: "an object",
    SPARSE: "a sparse matrix",
    FUNCTION: "a function",
    OPAQUE: "an object (a table or time series): save its columns as vectors",
}
"""Names of matrix types that are not read as numbers."""
HEADER, OLD_HEADER = 128, 20
HDF5 = b"\x89HDF"
"""First bytes of a file of version 7.3 without a MATLAB header."""
LARGEST = 2**29
"""Largest size of an uncompressed element [bytes]."""
DEEPEST = 20
"""Largest nesting depth of structs."""

Node = Any
"""Numbers (array), a text or a description (str), a struct (dict), cells (list)."""


def variables(content: bytes) -> dict[str, Node]:
    """Return the variables by name.

    Raises:
        NotImplementedError: a file of version 7.3, which is HDF5.
        ValueError: not a MATLAB file, or a damaged one.
    """
    if content.startswith(HDF5):
        raise NotImplementedError
    order = {b"IM": "<", b"MI": ">"}.get(content[126:HEADER])
    if order is not None:
        if int.from_bytes(content[124:126], "little" if order == "<" else "big") >> 8 == 2:
            raise NotImplementedError
        return dict(_level_5(content[HEADER:], order))
    if 0 not in content[:4]:
        raise ValueError("the first bytes are not those of such a file")
    return dict(_level_4(content))


def _level_5(data: bytes, order: str) -> Iterator[tuple[str, Node]]:
    for kind, body in _elements(data, order):
        inner = _elements(_unfolded(body), order) if kind == COMPRESSED else ((kind, body),)
        yield from (_matrix(part, order) for what, part in inner if what == MATRIX)


def _unfolded(data: bytes) -> bytes:
    try:
        return zlib.decompressobj().decompress(data, LARGEST)
    except zlib.error as error:
        raise ValueError(f"a compressed variable is damaged ({error})") from None


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield type and data of the elements."""
    at = 0
    while at < len(data):
        if at + 8 > len(data):
            raise ValueError("it ends inside a tag")
        kind, size = (int(x) for x in np.frombuffer(data, f"{order}u4", 2, at))
        short = kind >> 16
        start = at + (4 if short else 8)
        kind, size = (kind & 0xFFFF, short) if short else (kind, size)
        if start + size > len(data) or (short and size > 4):
            raise ValueError("an element is longer than the rest of the file")
        yield kind, data[start : start + size]
        at = at + 8 if short else start + size
        if kind != COMPRESSED:
            at = -(-at // 8) * 8


def _matrix(data: bytes, order: str, depth: int = 0) -> tuple[str, Node]:
    parts = list(_elements(data, order))
    if not parts:
        return "", np.zeros((0, 0))
    flags = _numbers(*parts[0], order)
    if not flags.size or flags.dtype.kind not in "iu":
        raise ValueError("a variable has no type")
    kind = int(flags[0]) & 0xFF
    if kind == OPAQUE:  # names come first, dimensions never
        return (parts[1][1].decode("latin-1") if len(parts) > 1 else ""), CLASSES[kind]
    if len(parts) < 3:
        raise ValueError("a variable has no dimensions or no name")
    name, dimensions = parts[2][1].decode("latin-1"), _numbers(*parts[1], order)
    if dimensions.dtype.kind not in "iu":
        raise ValueError(f"variable {name!r} has no dimensions")
    shape = [int(n) for n in dimensions]
    if kind in CLASSES or len(parts) < 4:
        return name, CLASSES.get(kind, "nothing")
    if kind in (CELL, STRUCT):
        if depth >= DEEPEST:
            raise ValueError(f"variable {name!r} lies more than {DEEPEST} structs deep")
        return name, _nested(name, parts[3:], kind, order, depth)
    if kind == TEXT:
        return name, _text(*parts[3], order)
    if int(flags[0]) & 0x800:
        return name, "a matrix of complex numbers"
    return name, _shaped(name, _numbers(*parts[3], order), shape)


def _nested(name: str, parts: list[tuple[int, bytes]], kind: int, order: str, depth: int) -> Node:
    """Return a struct as a dict, a vector of structs as a list of them, cells as a list."""
    fields = [""]
    if kind == STRUCT:
        length = _numbers(*parts[0], order)
        if len(parts) < 2 or length.dtype.kind not in "iu" or length.size != 1 or length[0] < 1:
            raise ValueError(f"struct {name!r} has no fields")
        size, letters = int(length[0]), parts[1][1]
        cuts = range(0, len(letters), size)
        fields = [letters[k : k + size].split(b"\0")[0].decode("latin-1") for k in cuts]
        parts = parts[2:]
    if any(what != MATRIX for what, _ in parts) or not fields or len(parts) % len(fields):
        raise ValueError(f"variable {name!r} is cut off")
    values = [_matrix(body, order, depth + 1)[1] for _, body in parts]
    if kind == CELL:
        return values
    rows = range(0, len(values), len(fields))
    structs = [dict(zip(fields, values[k : k + len(fields)], strict=True)) for k in rows]
    return structs[0] if len(structs) == 1 else structs


def _text(kind: int, data: bytes, order: str) -> str:
    """Return text of one row; several rows in their storage order."""
    code = TEXTS.get(kind, "latin-1")
    if order == ">" and code == "utf-16-le":
        code = "utf-16-be"
    return data.decode(code, errors="replace").strip("\0 ")


def _numbers(kind: int, data: bytes, order: str) -> NDArray[np.generic]:
    code = NUMBERS.get(kind)
    if code is None or len(data) % int(code[1]):
        raise ValueError(f"an element of numbers is of type {kind} with {len(data)} bytes")
    return np.frombuffer(data, f"{order}{code}")


def _shaped(name: str, values: NDArray[np.generic], shape: list[int]) -> NDArray[np.generic]:
    if min(shape, default=-1) < 0 or prod(shape) != values.size:
        raise ValueError(f"variable {name!r} has {values.size} numbers for the shape {shape}")
    return values.reshape(shape, order="F")


def _level_4(data: bytes) -> Iterator[tuple[str, Node]]:
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
            raise ValueError("the header of a variable is not that of such a file")
        code = OLD_NUMBERS[rest // 10]
        name = data[start : start + length - 1].decode("latin-1")
        start += length
        size = rows * columns * int(code[1])
        if start + size * (1 + imaginary) > len(data):
            raise ValueError(f"variable {name!r} is longer than the rest of the file")
        if rest % 10 or imaginary:
            yield name, "text, sparse or complex"
        else:
            numbers = np.frombuffer(data, f"{order}{code}", rows * columns, start)
            yield name, _shaped(name, numbers, [rows, columns])
        at = start + size * (1 + imaginary)
