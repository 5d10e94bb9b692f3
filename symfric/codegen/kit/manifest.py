"""The manifest of a kit: all that a machine needs to know of it, as JSON."""

from collections.abc import Mapping, Sequence
from hashlib import sha256
from importlib.metadata import version
from math import isfinite
from typing import Any

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.guards import MEANING, Range, Status, parameter_range, range_of
from symfric.codegen.writing.layout import members, prefix
from symfric.codegen.writing.routines import routines
from symfric.emitter.c99 import Real
from symfric.foundation.parameters import Variable


def manifest(
    block: Block,
    reals: Sequence[Real],
    guards: bool,
    texts: Mapping[str, str],
    measured: Mapping[str, Any],
) -> dict[str, Any]:
    """Content of NAME_manifest.json.

    Args:
        texts: files of the kit and their content.
        measured: by type, sizes and stack that a compiler made, empty where none did.
    """
    return {
        "name": block.name,
        "model": block.fingerprint,
        "symfric": version("symfric"),
        "casadi": version("casadi"),
        "about": block.doc,
        "equations": block.equations.splitlines(),
        "discretisation": block.discretisation.splitlines(),
        "sample_time": block.sample_time,
        "use": list(block.use),
        "limits": list(block.limits),
        "sources": list(block.sources),
        "states": [_variable(v, "start", None) for v in block.states],
        "parameters": [
            _variable(v, "default", parameter_range(v) if guards else None)
            for v in block.parameters
        ],
        "inputs": [_variable(v, "safe", range_of(v) if guards else None) for v in block.inputs],
        "outputs": [
            {"name": name, "unit": output.unit, "doc": output.doc}
            for name, output in block.outputs.items()
        ],
        "constants": dict(block.constants),
        "guards": guards,
        "status": {str(s.name): {"bit": int(s), "meaning": MEANING[s]} for s in Status}
        if guards
        else {},
        "real": {
            real.name: _described(block, real, guards) | dict(measured.get(real.name, {}))
            for real in reals
        },
        "files": {
            name: {"bytes": len(data), "sha256": sha256(data).hexdigest()}
            for name, data in ((n, text.encode()) for n, text in texts.items())
        },
    }


def _variable(variable: Variable, start: str, within: Range | None) -> dict[str, Any]:
    """Meaning, unit and range; of what guards watch the range that they keep."""
    low, high = (variable.lower, variable.upper) if within is None else (within.low, within.high)
    return {
        "name": variable.name,
        "unit": variable.unit,
        "doc": variable.doc,
        "nominal": variable.nominal,
        "range": [bound if isfinite(bound) else None for bound in (low, high)],
        start: float(variable.start) if within is None else within.safe,
    }


def _described(block: Block, real: Real, guards: bool) -> dict[str, Any]:
    name = prefix(block, real)
    return {
        "header": f"{name}.h",
        "source": f"{name}.c",
        "bytes": {
            group: real.size * sum(row.count for row in rows)
            for group, rows in members(block).items()
        },
        "functions": {
            routine.name: {
                "prototype": f"{' '.join(routine.head.split())};",
                "operations": routine.operations,
                "calls": dict(sorted(routine.calls.items())),
            }
            for routine in routines(block, real, guards)
        },
    }
