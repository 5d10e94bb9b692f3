"""Files of a block: header and source of each floating point type, and the export package."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any, final

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_law import contact_block, law_block
from symfric.codegen.blocks.variables import Fold
from symfric.codegen.guards import MEANING, Range, Status, parameter_range, range_of
from symfric.codegen.header import header
from symfric.codegen.kit import kit_files
from symfric.codegen.layout import members, prefix
from symfric.codegen.routines import routines, source
from symfric.codegen.runner import footprint
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Variable, check_names
from symfric.foundation.programs import CompileError, find_compiler
from symfric.laws import AnyLaw, Population


@final
@dataclass(frozen=True, eq=False)
class Generated:
    """Files that `generate` wrote.

    Attributes:
        block: source of the C.
        folder: of the files.
        reals: floating point types, by name.
        files: all files, the manifest last.
        manifest: content of NAME_manifest.json.
        guards: True if the C has guards, see `symfric.codegen.guards`.
    """

    block: Block
    folder: Path
    reals: tuple[str, ...]
    files: tuple[Path, ...]
    manifest: Mapping[str, Any]
    guards: bool = True

    def header(self, real: str) -> Path:
        """Return the header file of the type `real`."""
        return self.folder / f"{prefix(self.block, REALS[real])}.h"

    def source(self, real: str) -> Path:
        """Return the source file of the type `real`."""
        return self.folder / f"{prefix(self.block, REALS[real])}.c"


def generate(
    law: AnyLaw | Block,
    out: str | Path,
    *,
    name: str | None = None,
    real: str | Sequence[str] = ("double", "float"),
    h: float | None = None,
    free: Sequence[str] | None = None,
    fold: Fold = None,
    turning: bool = False,
    guards: bool = True,
    kit: bool = True,
) -> Generated:
    """Write a friction law, or any block, as C99.

    The files for each type are `NAME_f64.h`, with the data sheet at its head, and `NAME_f64.c`
    (float: `f32`). The export package adds test vectors and a unit test in C (`NAME_f64_test.c`,
    `..._vectors.h`, `.csv`), `CMakeLists.txt` and `NAME_block.cmake`, a loader for Python without
    symfric (`NAME_ctypes.py`), an S-function for Simulink (`NAME_sfun.c`) and `NAME_manifest.json`
    with meanings, units, ranges, hashes, operation counts and, if there is a compiler, sizes and
    stack. All names but CMakeLists.txt, which is the same for all, begin with that of the block, so
    that several packages may share a folder and a program.

    The C allocates nothing, includes only math.h, stdbool.h and, for the guards, stdint.h and
    string.h, has no data but constants, and compiles without warnings under -Wall -Wextra
    -Wpedantic -Wconversion -Wdouble-promotion, also as C++.

    Args:
        law: a friction law, see `law_block`; a population, see `contact_block`; or a block.
        out: folder, created if missing; files of the same names are replaced.
        name: C identifier; default the name of the law.
        real: "double", "float" or both.
        h: step size [s] as a constant instead of a parameter (laws with states).
        free, fold: parameters that stay variable at run time, or become constants, see `law_block`;
            by default they are fields of a struct, with a constant struct of defaults. Those of a
            population are constants.
        turning: True for a contact that turns: rad/s and N m in its texts.
        guards: clamp inputs to their ranges, repair values that are not finite, and report it in a
            status; see `symfric.codegen.guards`. Valid values are not changed by a bit.
        kit: False writes only sources and manifest, without sizes.

    Raises:
        ValueError: bad input, a law that has no step, an operation that C99 lacks, a number
            outside the range of float (a computed one below it becomes the smallest nonzero one).
    """
    several = (real,) if isinstance(real, str) else checks.many("codegen: real", real, "types")
    check_names("codegen: real", several, REALS)
    names = tuple(dict.fromkeys(several))
    folder = checks.path("codegen: out", out)
    checks.flag("codegen: guards", guards)
    if not names:
        raise ValueError("codegen: real: expected double, float or both, got none")
    given = {"name": name, "h": h, "free": free, "fold": fold, "turning": turning or None}
    block = _block(law, {option: value for option, value in given.items() if value is not None})
    reals = [REALS[n] for n in names]
    for one in reals:
        for value in block.constants.values():
            one.literal(value)  # raises an error if rounded to 0 or infinity
    texts: dict[str, str] = {}
    for one in reals:
        texts[f"{prefix(block, one)}.h"] = header(block, one, guards)
        texts[f"{prefix(block, one)}.c"] = source(block, one, guards)
    texts |= kit_files(block, reals, guards) if kit else {}
    for file, text in texts.items():
        write_text(folder / file, text)
    content = manifest(block, reals, guards, texts, _measured(block, reals, folder) if kit else {})
    last = f"{block.name}_manifest.json"
    write_text(folder / last, json.dumps(content, indent=2) + "\n")
    files = tuple(folder / file for file in (*texts, last))
    return Generated(block, folder, names, files, content, guards)


def with_cores(generated: Generated, measured: Sequence[Mapping[str, Any]]) -> Generated:
    """Add measurements on other cores to the manifest, also in the file.

    Args:
        measured: results of `symfric.embedded` for each core and type, as `Measured.to_dict`.
    """
    if not measured:
        return generated
    content = {**generated.manifest, "cores": [dict(row) for row in measured]}
    write_text(generated.files[-1], json.dumps(content, indent=2) + "\n")
    return replace(generated, manifest=content)


def _measured(block: Block, reals: Sequence[Real], folder: Path) -> dict[str, dict[str, Any]]:
    """Return sizes and stack by type from the compiler of this machine, if it has one."""
    compiler = find_compiler()
    if compiler is None:
        return {}
    found: dict[str, dict[str, Any]] = {}
    for real in reals:
        try:
            sizes = footprint(block, real, folder, compiler)
        except CompileError:  # no sizes without a working compiler; `verify` reports why
            continue
        found[real.name] = {"measured": {"compiler": str(compiler), **sizes.to_dict()}}
    return found


def _block(law: AnyLaw | Block, options: dict[str, Any]) -> Block:
    """Return the block of a law with the given `options`, all of which must apply."""
    allowed = ("name", "h", "free", "fold", "turning")
    what = "a law"
    if isinstance(law, Block):
        allowed, what = (), "a block, which has its own"
    elif isinstance(law, Population):
        allowed, what = ("name", "h"), "a population, whose numbers are constants and which slides"
    wrong = [option for option in options if option not in allowed]
    if wrong:
        raise ValueError(f"codegen: {', '.join(wrong)}: expected with a law only, got {what}")
    if isinstance(law, Block):
        return law
    return (contact_block if isinstance(law, Population) else law_block)(law, **options)  # pyright: ignore[reportArgumentType]


def manifest(
    block: Block,
    reals: Sequence[Real],
    guards: bool,
    texts: Mapping[str, str],
    measured: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the content of NAME_manifest.json.

    Args:
        texts: files of the package and their content.
        measured: by type, sizes and stack from a compiler, empty without one.
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
    """Return meaning, unit and range; for guarded variables the range that guards enforce."""
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
