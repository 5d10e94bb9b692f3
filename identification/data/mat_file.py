"""Reader of MATLAB files up to version 7 and NumPy files: variables, structs, matrices as columns.

The files of the EMPS benchmark are recognised with their controller.
Source: A. Janot, M. Gautier, M. Brunot: Data set and reference models of EMPS, 2019.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from identification.data.mat_bytes import variables
from identification.data.raw import Array, Column, Raw, label
from identification.data.record import PositionLoop, Record

EMPS = ("t", "qm", "vir", "gtau")
"""Variables that identify an EMPS file."""

Node = Any
"""An array, a text, a dict of nodes (struct), or a list of nodes (struct array, cell)."""


def read_mat(file: Path, variable: str | None) -> Record | list[Raw]:
    """Return the columns of each record in a MATLAB file; for an EMPS file the record itself.

    Args:
        file: the file.
        variable: a struct or matrix in it, with points for nested ones: "run.log"; a vector
            of structs takes an index: "run(2)".

    Raises:
        ValueError: not a MATLAB file, version 7.3, a damaged file, no such variable.
    """
    content = _load(file)
    where = f"read '{file.name}'"
    if variable is None and all(name in content for name in EMPS):
        return _emps(where, file.name, content)
    return raws(where, file.name, content, variable)


def read_npy(file: Path, variable: str | None) -> list[Raw]:
    """Return the columns of a `.npy` matrix or structured array, or of an `.npz` archive."""
    where = f"read '{file.name}'"
    try:
        loaded = np.load(BytesIO(file.read_bytes()), allow_pickle=False)
        archive = not isinstance(loaded, np.ndarray)
        content = {name: loaded[name] for name in loaded.files} if archive else {"array": loaded}
    except Exception as error:  # noqa: BLE001 (damaged bytes raise various errors)
        raise ValueError(
            f"{where}: expected a NumPy file of numbers, got a damaged or another file: {error}"
        ) from None
    return raws(where, file.name, {k: _node(v) for k, v in content.items()}, variable)


def raws(where: str, name: str, content: Mapping[str, Node], variable: str | None) -> list[Raw]:
    """Return the records in named variables."""
    if variable is not None:
        return list(_records(where, name, _found(where, content, variable), variable))
    vectors = {key: value for key, value in content.items() if _is_vector(value)}
    if len(vectors) > 1:
        return [_raw(where, name, dict(content))]
    tables = {k: v for k, v in content.items() if _is_matrix(v) or isinstance(v, dict | list)}
    structs = [v for v in tables.values() if isinstance(v, dict)]
    same = len(structs) > 1 and all(v.keys() == structs[0].keys() for v in structs)
    if same and len(structs) == len(tables):
        return [r for k, v in tables.items() for r in _records(where, f"{name}: {k}", v, k)]
    if len(tables) != 1:
        raise ValueError(
            f"{where}: expected one struct or matrix, or vectors of one length, got "
            f"{described(content) or 'no variables'}; name one with variable="
        )
    key, value = next(iter(tables.items()))
    return list(_records(where, name, value, key))


def described(content: Mapping[str, Node]) -> str:
    """Return a description of the variables."""
    return ", ".join(f"{key} ({_kind(value)})" for key, value in content.items())


def _kind(value: Node) -> str:
    if isinstance(value, dict):
        return f"a struct of {', '.join(map(str, value))}"  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list):
        return f"{len(value)} structs"  # pyright: ignore[reportUnknownArgumentType]
    return f"numbers {value.shape}" if isinstance(value, np.ndarray) else str(value)


def _records(where: str, name: str, value: Node, path: str) -> Iterator[Raw]:
    """Yield the records of one variable: several for a vector of structs, else one."""
    if isinstance(value, list):
        for k, one in enumerate(value, start=1):
            yield from _records(where, f"{name}({k})", one, f"{path}({k})")
    elif isinstance(value, dict):
        inner = {k: v for k, v in value.items() if isinstance(v, dict | list) or _is_matrix(v)}
        vectors = [k for k, v in value.items() if _is_vector(v)]
        logged = _simulink(value)
        if logged is not None:
            yield _raw(where, name, logged)
        elif not vectors and len(inner) == 1:
            key, deeper = next(iter(inner.items()))
            yield from _records(where, name, deeper, f"{path}.{key}")
        else:
            yield _raw(where, name, value)
    elif _is_matrix(value):
        yield _matrix(name, value)
    else:
        raise ValueError(
            f"{where}: variable {path}: expected a struct or a matrix of numbers, got "
            f"{_kind(value)}"
        )


def _simulink(struct: Mapping[str, Node]) -> dict[str, Node] | None:
    """Return the signals of a Simulink log (a structure with time), by their labels."""
    if "time" not in struct or "signals" not in struct:
        return None
    signals = struct["signals"]
    found: dict[str, Node] = {"time": struct["time"]}
    for k, signal in enumerate(signals if isinstance(signals, list) else [signals], start=1):
        if not isinstance(signal, dict) or "values" not in signal:
            return None
        text = signal.get("label", "")
        found[text if isinstance(text, str) and text else f"signal_{k}"] = signal["values"]
    return found


def _matrix(name: str, value: Array) -> Raw:
    """Return the columns of a matrix; a wide one is transposed."""
    if value.shape[0] < value.shape[1]:
        value = value.T
    columns = (Column.of("", "", c) for c in value.T)
    return Raw(name, tuple(columns))


def _raw(where: str, name: str, variables: Mapping[str, Node]) -> Raw:
    """Return the vectors of the most frequent length as columns; others are marked as unusable."""
    flat = _shortened(dict(_flat(variables)))
    lengths = [v.size for v in flat.values() if isinstance(v, np.ndarray)]
    if not lengths:
        raise ValueError(
            f"{where}: expected vectors of numbers, got {described(variables) or 'nothing'}"
        )
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    columns: list[Column] = []
    for key, value in flat.items():
        text, said = label(key)
        if not isinstance(value, np.ndarray):
            problem = f"expected a vector of numbers, got {value}"
            columns.append(Column(text, said, np.full(usual, np.nan), problem))
        elif value.size != usual:
            problem = f"expected {usual} numbers as in the others, got {value.size}"
            columns.append(Column(text, said, np.full(usual, np.nan), problem))
        else:
            columns.append(Column.of(text, said, value))
    return Raw(name, tuple(columns))


def _shortened(flat: Mapping[str, Node]) -> dict[str, Node]:
    """Return leaves by the last part of their names if it is unique."""
    last = [key.rpartition(".")[2] for key in flat]
    return {
        key if last.count(short) > 1 else short: value
        for (key, value), short in zip(flat.items(), last, strict=True)
    }


def _flat(variables: Mapping[str, Node], prefix: str = "") -> Iterator[tuple[str, Node]]:
    """Yield leaves by name; fields of a struct are prefixed by its name."""
    for key, value in variables.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        elif _is_vector(value):
            yield f"{prefix}{key}", np.asarray(value, dtype=float).ravel()
        elif _is_matrix(value):
            turned = value if value.shape[0] >= value.shape[1] else value.T
            for k, column in enumerate(turned.T, start=1):
                yield f"{prefix}{key}_{k}", column
        else:
            yield f"{prefix}{key}", _kind(value)


def _is_vector(value: Node) -> bool:
    return isinstance(value, np.ndarray) and value.size > 1 and max(value.shape) == value.size


def _is_matrix(value: Node) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2 and min(value.shape) > 1


def _load(file: Path) -> dict[str, Node]:
    try:
        loaded = variables(file.read_bytes())
    except NotImplementedError:
        raise ValueError(
            f"read '{file.name}': expected a MATLAB file of version 7 or older, got version 7.3 "
            "(HDF5); save it with save(name, '-v7')"
        ) from None
    except ValueError as error:
        raise ValueError(
            f"read '{file.name}': expected a MATLAB file, got a damaged or another file: {error}"
        ) from None
    return {key: _node(value) for key, value in loaded.items() if key and key[:2] != "__"}


def _node(value: Any) -> Node:
    """Return the node with arrays of floats, and fields of structured arrays as a dict."""
    if isinstance(value, dict):
        return {str(key): _node(one) for key, one in value.items()}  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list):
        items = [_node(item) for item in value]  # pyright: ignore[reportUnknownVariableType]
        return items[0] if len(items) == 1 else items
    if not isinstance(value, np.ndarray):
        return str(value)
    if value.dtype.names:
        return {name: _node(value[name]) for name in value.dtype.names}
    if value.dtype.kind in "iufb":
        numbers = value.astype(float)
        return np.squeeze(numbers) if numbers.ndim > 2 else numbers
    return f"values of type {value.dtype}"


def _vector(where: str, found: Mapping[str, Node], name: str) -> Array:
    value = found[name]
    if not _is_vector(value):
        raise ValueError(
            f"{where}: variable {name}: expected a vector of numbers, got {_kind(value)}"
        )
    return value.ravel()


def _number(where: str, found: Mapping[str, Node], name: str) -> float:
    value = found[name]
    if not isinstance(value, np.ndarray) or value.size != 1:
        raise ValueError(f"{where}: variable {name}: expected one number, got {_kind(value)}")
    return float(value.ravel()[0])


def _emps(where: str, name: str, found: Mapping[str, Node]) -> Record:
    """Return the record of an EMPS file: force gtau*vir; pulses_N (volts, uint8) are in vir."""
    t, x, command = (_vector(where, found, key) for key in ("t", "qm", "vir"))
    gain = _number(where, found, "gtau")
    signals, units = {"x": x, "force": gain * command}, {"x": "m", "force": "N"}
    record = Record(name, t, signals, units, columns={"x": "qm"})
    if not all(key in found for key in ("kp", "kv", "qg")):
        return record
    pulses = "pulses_N" in found
    loop = PositionLoop(
        kp=_number(where, found, "kp"),
        kv=_number(where, found, "kv"),
        gain=gain,
        limit=10.0,
        reference=_vector(where, found, "qg"),
        disturbance=_vector(where, found, "pulses_N") if pulses else np.zeros(t.size),
    )
    return replace(record, loop=loop)


def _found(where: str, content: Mapping[str, Node], path: str) -> Node:
    """Return the node at a path such as "run(2).log"."""
    node: Node = dict(content)
    for part in path.split("."):
        name, _, index = part.partition("(")
        if not isinstance(node, dict) or name not in node:
            have = described(node) if isinstance(node, dict) else _kind(node)  # pyright: ignore[reportUnknownArgumentType]
            raise ValueError(f"{where}: expected a variable '{path}', got {have or 'none'}")
        node = node[name]
        if index:
            number = index.rstrip(")")
            most = len(node) if isinstance(node, list) else 1  # pyright: ignore[reportUnknownArgumentType]
            if not number.isdigit() or not 1 <= int(number) <= most:
                raise ValueError(
                    f"{where}: variable {path}: expected an index from 1 to {most}, got '{number}'"
                )
            node = node[int(number) - 1] if isinstance(node, list) else node
    return node
