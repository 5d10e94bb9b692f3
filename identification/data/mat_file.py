"""Reader of MATLAB files up to version 7 and NumPy files: variables, structs, matrices as columns.

A level 5 file consists of a header and elements, each with a tag (type, bytes) and data. A matrix
is an element that contains elements: flags, dimensions, name, numbers; those of structs and cell
arrays contain matrices. A level 4 file is a sequence of matrices with headers of five integers.
`scipy.io.loadmat` reads the same files but crashes (segmentation fault) on damaged ones. Files of
the EMPS benchmark are recognised and read with their controller.
Sources: The MathWorks, MAT-File Format, 2023; A. Janot, M. Gautier, M. Brunot: Data set and
reference models of EMPS, 2019.
"""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from identification.data.raw import Array, Column, Raw, label
from identification.data.record import PositionLoop, Record

Node = Any
"""Array of floats, text or description, dict of nodes (struct), or list of nodes (struct array,
cells).
"""

NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
"""NumPy types by the type number of an element."""
OLD_NUMBERS = ("f8", "f4", "i4", "i2", "u2", "u1")
"""NumPy types by the digit P of level 4."""
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
"""Encodings by the type number of a text element."""
MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, TEXT, OPAQUE = 1, 2, 4, 17
CLASSES = {
    3: "an object",
    5: "a sparse matrix",
    16: "a function",
    OPAQUE: "an object (a table or time series): save its columns as vectors",
}
"""Names of matrix types that are not read as numbers."""
COMPLEX = 0x800
HEADER, OLD_HEADER = 128, 20
HDF5 = b"\x89HDF"
"""First bytes of a version 7.3 file without a MATLAB header."""
LARGEST = 2**29
"""Largest size of an uncompressed element [bytes]."""


def variables(content: bytes) -> dict[str, Node]:
    """Return the variables by name.

    Raises:
        NotImplementedError: a file of version 7.3, which is HDF5.
        ValueError, IndexError, ...: the file is damaged or not a MATLAB file.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:HEADER])
    version = content[125 if order == "<" else 124 : 126][:1]
    if content.startswith(HDF5) or (order is not None and version == b"\x02"):
        raise NotImplementedError
    if order is not None:
        return dict(_level_5(content[HEADER:], order))
    if 0 not in content[:4]:
        raise ValueError("the first bytes are not those of such a file")
    return dict(_level_4(content))


def node(value: Any) -> Node:
    """Return numbers as floats, structured arrays as a dict, and other arrays as a description."""
    if value.dtype.names:
        return {name: node(value[name]) for name in value.dtype.names}
    if value.dtype.kind not in "iufb":
        return f"values of type {value.dtype}"
    numbers = value.astype(float)
    return np.squeeze(numbers) if numbers.ndim > 2 else numbers


def _level_5(data: bytes, order: str) -> Iterator[tuple[str, Node]]:
    for kind, body in _elements(data, order):
        inner = ((kind, body),)
        if kind == COMPRESSED:
            inner = _elements(zlib.decompressobj().decompress(body, LARGEST), order)
        yield from (_matrix(part, order) for what, part in inner if what == MATRIX)


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield type and data of each element."""
    at = 0
    while at < len(data):
        kind, size = np.frombuffer(data, f"{order}u4", 2, at).tolist()
        short = kind >> 16
        start = at + (4 if short else 8)
        kind, size = (kind & 0xFFFF, short) if short else (kind, size)
        if start + size > len(data) or short > 4:
            raise ValueError("an element is longer than the rest of the file")
        yield kind, data[start : start + size]
        at = at + 8 if short else start + size
        if kind != COMPRESSED:
            at = -(-at // 8) * 8


def _matrix(data: bytes, order: str) -> tuple[str, Node]:
    """Return name and content of a matrix."""
    parts = list(_elements(data, order))
    if not parts:
        return "", np.zeros((0, 0))
    flags = int(_numbers(*parts[0], order)[0])
    kind = flags & 0xFF
    if kind == OPAQUE:  # the name comes first, and there are no dimensions
        return (parts[1][1].decode("latin-1") if len(parts) > 1 else ""), CLASSES[kind]
    shape, name = _numbers(*parts[1], order).tolist(), parts[2][1].decode("latin-1")
    if kind in CLASSES or len(parts) < 4:
        return name, CLASSES.get(kind, "nothing")
    if kind in (CELL, STRUCT):
        return name, _nested(name, parts[3:], kind, order)
    if kind == TEXT:
        return name, _text(*parts[3], order)
    if flags & COMPLEX:
        return name, "a matrix of complex numbers"
    return name, node(_numbers(*parts[3], order).reshape(shape, order="F"))


def _nested(name: str, parts: list[tuple[int, bytes]], kind: int, order: str) -> Node:
    """Return a struct as a dict, a vector of structs as a list of dicts, and cells as a list."""
    fields = [""]
    if kind == STRUCT:
        size, letters = int(_numbers(*parts[0], order)[0]), parts[1][1]
        cuts = range(0, len(letters), size)
        fields = [letters[k : k + size].split(b"\0")[0].decode("latin-1") for k in cuts]
        parts = parts[2:]
    if len(parts) % len(fields) or any(what != MATRIX for what, _ in parts):
        raise ValueError(f"variable {name!r} is cut off")
    found: list[Node] = [_matrix(body, order)[1] for _, body in parts]
    if kind == STRUCT:
        rows = range(0, len(found), len(fields))
        found = [dict(zip(fields, found[k : k + len(fields)], strict=True)) for k in rows]
    return found[0] if len(found) == 1 else found


def _text(kind: int, data: bytes, order: str) -> str:
    """Return the text of one row; several rows are joined in storage order."""
    code = TEXTS.get(kind, "latin-1")
    code += {"<": "-le", ">": "-be"}[order] if kind == 4 else ""
    return data.decode(code, errors="replace").strip("\0 ")


def _numbers(kind: int, data: bytes, order: str) -> Any:
    if kind not in NUMBERS:
        raise ValueError(f"an element of numbers is of type {kind}")
    return np.frombuffer(data, order + NUMBERS[kind])


def _level_4(data: bytes) -> Iterator[tuple[str, Node]]:
    at = 0
    while at < len(data):
        order = "<" if 0 <= int(np.frombuffer(data, "<i4", 1, at)[0]) < 5000 else ">"
        kind, rows, columns, imaginary, length = np.frombuffer(data, f"{order}i4", 5, at).tolist()
        machine, rest = divmod(kind, 1000)
        known = machine == (order == ">") and 0 <= rest // 10 < len(OLD_NUMBERS)
        if not known or min(rows, columns) < 0 or imaginary not in (0, 1) or length < 2:
            raise ValueError("the header of a variable is not that of such a file")
        code, start = order + OLD_NUMBERS[rest // 10], at + OLD_HEADER + length
        name = data[at + OLD_HEADER : start - 1].decode("latin-1")
        size = rows * columns * int(code[2])
        if start + size * (1 + imaginary) > len(data):
            raise ValueError(f"variable {name!r} is longer than the rest of the file")
        content: Node = "text, sparse or complex"
        if not (rest % 10 or imaginary):
            numbers = np.frombuffer(data, code, rows * columns, start)
            content = node(numbers.reshape(rows, columns, order="F"))
        yield name, content
        at = start + size * (1 + imaginary)


def read_variables(file: Path, variable: str | None) -> Record | list[Raw]:
    """Return the columns of each record in a file; for an EMPS file, the record.

    Args:
        file: a MATLAB file, a `.npy` matrix or structured array, or an `.npz` archive.
        variable: a struct or matrix in the file, with points for nested ones: "run.log"; a vector
            of structs takes an index: "run(2)".

    Raises:
        ValueError: another type of file, version 7.3, a damaged file, or no such variable.
    """
    where, data = f"read '{file.name}'", file.read_bytes()
    such = "MATLAB file" if file.suffix.lower() == ".mat" else "NumPy file of numbers"
    try:
        if such == "MATLAB file":
            content = variables(data)
        else:
            loaded: Any = np.load(BytesIO(data), allow_pickle=False)
            held = {"array": loaded} if isinstance(loaded, np.ndarray) else loaded
            content = {name: node(held[name]) for name in held}
    except NotImplementedError:
        raise ValueError(
            f"{where}: expected a MATLAB file of version 7 or older, got version 7.3 "
            "(HDF5); save it with save(name, '-v7'), or rename it to .h5"
        ) from None
    except Exception as error:  # noqa: BLE001 (damaged bytes raise various errors)
        raise ValueError(
            f"{where}: expected a {such}, got a damaged or another file: {error}"
        ) from None
    content = {key: value for key, value in content.items() if key and key[:2] != "__"}
    return of_variables(where, file.name, content, variable)


def of_variables(
    where: str, name: str, content: Mapping[str, Node], variable: str | None
) -> Record | list[Raw]:
    """Return the columns of variables, or of the one at a path such as "run(2).log"."""
    if variable is None and all(key in content for key in EMPS):
        return _emps(where, name, content)
    if variable is not None:
        return list(_records(where, name, _found(where, content, variable), variable))
    if sum(map(_is_vector, content.values())) > 1:
        return [_raw(where, name, content)]
    tables = {k: v for k, v in content.items() if _is_matrix(v) or isinstance(v, dict | list)}
    fields = {frozenset(v) if isinstance(v, dict) else None for v in tables.values()}
    if (len(tables) > 1 and (len(fields) > 1 or None in fields)) or not tables:
        raise ValueError(
            f"{where}: expected one struct or matrix, or vectors of one length, got "
            f"{_described(content) or 'no variables'}; name one with variable="
        )
    names = {k: f"{name}: {k}" if len(tables) > 1 else name for k in tables}
    return [raw for k, v in tables.items() for raw in _records(where, names[k], v, k)]


def _described(content: Mapping[str, Node]) -> str:
    """Return a description of the variables."""
    return ", ".join(f"{key} ({_kind(value)})" for key, value in content.items())


def _kind(value: Node) -> str:
    if isinstance(value, dict):
        return f"a struct of {', '.join(value)}"  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list):
        return f"{len(value)} structs"  # pyright: ignore[reportUnknownArgumentType]
    return f"numbers {value.shape}" if isinstance(value, np.ndarray) else str(value)


def _records(where: str, name: str, value: Node, path: str) -> Iterator[Raw]:
    """Yield the records of one variable: several for a vector of structs, otherwise one."""
    if isinstance(value, list):
        for k, one in enumerate(value, start=1):  # pyright: ignore[reportUnknownVariableType]
            yield from _records(where, f"{name}({k})", one, f"{path}({k})")
    elif isinstance(value, dict):
        struct: dict[str, Node] = _simulink(value) or value  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        inner = [k for k, v in struct.items() if isinstance(v, dict | list) or _is_matrix(v)]
        if len(inner) == 1 and not any(map(_is_vector, struct.values())):
            yield from _records(where, name, struct[inner[0]], f"{path}.{inner[0]}")
        else:
            yield _raw(where, name, struct)
    elif _is_matrix(value):
        yield Raw(name, tuple(Column.of("", "", c) for c in _upright(value).T))
    else:
        raise ValueError(
            f"{where}: variable {path}: expected a struct or a matrix of numbers, got "
            f"{_kind(value)}"
        )


def _simulink(struct: Mapping[str, Node]) -> dict[str, Node] | None:
    """Return the signals of a Simulink log (structure with time) by label; None for others."""
    if "time" not in struct or "signals" not in struct:
        return None
    signals = struct["signals"]
    found: dict[str, Node] = {"time": struct["time"]}
    for k, signal in enumerate(signals if isinstance(signals, list) else [signals], start=1):  # pyright: ignore[reportUnknownVariableType]
        if not isinstance(signal, dict) or "values" not in signal:
            return None
        text: Any = signal.get("label", "")  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
        found[text if isinstance(text, str) and text else f"signal_{k}"] = signal["values"]
    return found


def _raw(where: str, name: str, content: Mapping[str, Node]) -> Raw:
    """Return vectors of the most frequent length as columns; mark other variables as unusable."""
    flat = dict(_flat(content))
    lengths = [v.size for v in flat.values() if isinstance(v, np.ndarray)]
    if not lengths:
        got = _described(content) or "nothing"
        raise ValueError(f"{where}: expected vectors of numbers, got {got}")
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    last = [key.rpartition(".")[2] for key in flat]
    columns: list[Column] = []
    for (key, value), short in zip(flat.items(), last, strict=True):
        text, unit = label(key if last.count(short) > 1 else short)
        if isinstance(value, np.ndarray) and value.size == usual:
            columns.append(Column.of(text, unit, value))
            continue
        problem = f"expected a vector of numbers, got {value}"
        if isinstance(value, np.ndarray):
            problem = f"expected {usual} numbers as in the others, got {value.size}"
        columns.append(Column(text, unit, np.full(usual, np.nan), problem))
    return Raw(name, tuple(columns))


def _flat(content: Mapping[str, Node], prefix: str = "") -> Iterator[tuple[str, Node]]:
    """Yield name and value of each leaf; a field is prefixed by the name of its struct."""
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")  # pyright: ignore[reportUnknownArgumentType]
        elif _is_vector(value):
            yield f"{prefix}{key}", value.ravel()
        elif _is_matrix(value):
            for k, column in enumerate(_upright(value).T, start=1):
                yield f"{prefix}{key}_{k}", column
        else:
            yield f"{prefix}{key}", _kind(value)


def _upright(matrix: Array) -> Array:
    """Return a matrix, transposed if it has more columns than rows."""
    return matrix if matrix.shape[0] >= matrix.shape[1] else matrix.T


def _is_vector(value: Node) -> bool:
    return isinstance(value, np.ndarray) and value.size > 1 and max(value.shape) == value.size


def _is_matrix(value: Node) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2 and min(value.shape) > 1


def _found(where: str, content: Mapping[str, Node], path: str) -> Node:
    """Return the node at a path such as "run(2).log"."""
    at: Node = dict(content)
    for part in path.split("."):
        name, _, index = part.partition("(")
        if not isinstance(at, dict) or name not in at:
            have = _described(at) if isinstance(at, dict) else _kind(at)  # pyright: ignore[reportUnknownArgumentType]
            raise ValueError(f"{where}: expected a variable '{path}', got {have or 'none'}")
        at = at[name]  # pyright: ignore[reportUnknownVariableType]
        if index:
            several: list[Node] = at if isinstance(at, list) else [at]
            number = index.rstrip(")")
            if not number.isdigit() or not 1 <= int(number) <= len(several):
                raise ValueError(
                    f"{where}: variable {path}: expected an index from 1 to {len(several)}, got "
                    f"'{number}'"
                )
            at = several[int(number) - 1]
    return at


EMPS = ("t", "qm", "vir", "gtau")
"""Variables that identify an EMPS file."""


def _emps(where: str, name: str, content: Mapping[str, Node]) -> Record:
    """Return the record of an EMPS file; the force gtau*vir includes pulses_N (volts, uint8)."""

    def read(key: str, number: bool = False) -> Any:
        value = content[key]
        if not (isinstance(value, np.ndarray) and value.size == 1 if number else _is_vector(value)):
            such = "one number" if number else "a vector of numbers"
            raise ValueError(f"{where}: variable {key}: expected {such}, got {_kind(value)}")
        return float(value.ravel()[0]) if number else value.ravel()

    x, gain = read("qm"), read("gtau", number=True)
    signals, units = {"x": x, "force": gain * read("vir")}, {"x": "m", "force": "N"}
    record = Record(name, read("t"), signals, units, columns={"x": "qm"})
    if not all(key in content for key in ("kp", "kv", "qg")):
        return record
    pulses = read("pulses_N") if "pulses_N" in content else np.zeros(x.size)
    kp, kv = read("kp", number=True), read("kv", number=True)
    return replace(record, loop=PositionLoop(kp, kv, gain, 10.0, read("qg"), pulses))
