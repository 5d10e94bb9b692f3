"""Read measured records from MATLAB files; the EMPS benchmark is recognised."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from identification.data import Array, Dataset
from identification.filters import Filter
from identification.loop import PositionLoop

EMPS = ("t", "qm", "vir", "gtau")
"""Variables that tell an EMPS file."""
EMPS_FILTER = Filter(cutoff=100.0, decimation=10)
"""The published cut-off and decimation, so that force errors compare with the published ones."""


def read_mat(file: Path, names: Mapping[str, tuple[str, ...]]) -> Dataset:
    """The record in `file`; `names` lists the variables each signal may be stored as, in SI.

    Raises:
        ValueError: no scipy, not a MATLAB file, a missing variable or one that is no vector.
    """
    variables = _load(file)
    if all(name in variables for name in EMPS):
        return _emps(file.name, variables)
    found = {key: [n for n in options if n in variables] for key, options in names.items()}
    missing = [names[key][0] for key in ("t", "x", "force") if not found[key]]
    if missing:
        raise ValueError(
            f"read '{file.name}': expected variables {', '.join(missing)}, got "
            f"{', '.join(sorted(variables)) or 'none'}; name them with columns="
        )
    signals = {k: _vector(file.name, variables, hit[0]) for k, hit in found.items() if hit}
    return Dataset(file.name, signals["t"], signals["x"], signals["force"], signals.get("v"))


def _load(file: Path) -> dict[str, Any]:
    try:
        from scipy.io import loadmat  # noqa: PLC0415  (scipy is an extra)
        from scipy.io.matlab import MatReadError  # noqa: PLC0415
    except ImportError:
        raise ValueError(
            f"read '{file.name}': expected scipy for MATLAB files, got none; "
            "install symfric[mat] or export the record as CSV"
        ) from None
    try:
        content: dict[str, Any] = loadmat(file)
    except NotImplementedError:
        raise ValueError(
            f"read '{file.name}': expected a MATLAB file of version 7 or older, got version 7.3; "
            "save it with -v7"
        ) from None
    except (MatReadError, ValueError, OSError) as error:
        raise ValueError(f"read '{file.name}': expected a MATLAB file, got: {error}") from None
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _vector(where: str, variables: Mapping[str, Any], name: str) -> Array:
    value: Any = np.squeeze(variables[name])
    if value.ndim != 1 or value.dtype.kind not in "fiub":
        raise ValueError(
            f"read '{where}': variable {name}: expected a vector of numbers, "
            f"got shape {np.shape(variables[name])} of {value.dtype}"
        )
    return value.astype(float)


def _emps(where: str, variables: Mapping[str, Any]) -> Dataset:
    """An EMPS file: force gtau*vir; pulses_N are volts, uint8, and already inside vir."""
    t, x, command = (_vector(where, variables, name) for name in ("t", "qm", "vir"))
    gain = float(np.squeeze(variables["gtau"]))
    loop = None
    if all(name in variables for name in ("kp", "kv", "qg")):
        pulses = "pulses_N" in variables
        loop = PositionLoop(
            kp=float(np.squeeze(variables["kp"])),
            kv=float(np.squeeze(variables["kv"])),
            gain=gain,
            limit=10.0,
            reference=_vector(where, variables, "qg"),
            disturbance=_vector(where, variables, "pulses_N") if pulses else np.zeros(t.size),
        )
    return Dataset(where, t, x, gain * command, loop=loop, filter=EMPS_FILTER, benchmark="EMPS")
