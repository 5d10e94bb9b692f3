"""Read measured records from MATLAB files; the EMPS benchmark is recognised."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.old.data import Array, Dataset
from identification.old.filters import Filter
from identification.old.loop import PositionLoop
from identification.old.matfile import variables

Variable = NDArray[np.generic] | str
EMPS = ("t", "qm", "vir", "gtau")
"""Variables that tell an EMPS file."""
EMPS_FILTER = Filter(cutoff=100.0, decimation=10)
"""The published cut-off and decimation, so that force errors compare with the published ones."""


def read_mat(file: Path, names: Mapping[str, tuple[str, ...]]) -> Dataset:
    """The record in `file`; `names` lists the variables each signal may be stored as, in SI.

    Raises:
        ValueError: not a MATLAB file, a damaged one, a missing variable or one that is no vector.
    """
    content = _load(file)
    if all(name in content for name in EMPS):
        return _emps(file.name, content)
    found = {key: [n for n in options if n in content] for key, options in names.items()}
    missing = [names[key][0] for key in ("t", "x", "force") if not found[key]]
    if missing:
        raise ValueError(
            f"read '{file.name}': expected variables {', '.join(missing)}, got "
            f"{', '.join(sorted(content)) or 'none'}; name them with columns="
        )
    signals = {k: _vector(file.name, content, hit[0]) for k, hit in found.items() if hit}
    return Dataset(file.name, signals["t"], signals["x"], signals["force"], signals.get("v"))


def _load(file: Path) -> dict[str, Variable]:
    try:
        content = variables(file.read_bytes())
    except NotImplementedError:
        raise ValueError(
            f"read '{file.name}': expected a MATLAB file of version 7 or older, got version 7.3; "
            "save it with -v7"
        ) from None
    except ValueError as error:
        raise ValueError(
            f"read '{file.name}': expected a MATLAB file, got one that is damaged or none: {error}"
        ) from None
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _vector(where: str, found: Mapping[str, Variable], name: str) -> Array:
    value = found[name]
    if isinstance(value, str) or np.squeeze(value).ndim != 1:
        what = value if isinstance(value, str) else f"shape {value.shape} of {value.dtype}"
        raise ValueError(
            f"read '{where}': variable {name}: expected a vector of numbers, got {what}"
        )
    return np.squeeze(value).astype(float)


def _number(where: str, found: Mapping[str, Variable], name: str) -> float:
    value = found[name]
    if isinstance(value, str) or value.size != 1:
        what = value if isinstance(value, str) else f"shape {value.shape}"
        raise ValueError(f"read '{where}': variable {name}: expected one number, got {what}")
    return float(value.astype(float).ravel()[0])


def _emps(where: str, found: Mapping[str, Variable]) -> Dataset:
    """An EMPS file: force gtau*vir; pulses_N are volts, uint8, and already inside vir."""
    t, x, command = (_vector(where, found, name) for name in ("t", "qm", "vir"))
    gain = _number(where, found, "gtau")
    loop = None
    if all(name in found for name in ("kp", "kv", "qg")):
        pulses = "pulses_N" in found
        loop = PositionLoop(
            kp=_number(where, found, "kp"),
            kv=_number(where, found, "kv"),
            gain=gain,
            limit=10.0,
            reference=_vector(where, found, "qg"),
            disturbance=_vector(where, found, "pulses_N") if pulses else np.zeros(t.size),
        )
    return Dataset(where, t, x, gain * command, loop=loop, filter=EMPS_FILTER, benchmark="EMPS")
