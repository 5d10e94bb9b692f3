"""Files of a block: header and source for each floating-point type, and the export package."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any, final

from symfric.codegen.blocks.block import SHEET, Block, CBlock
from symfric.codegen.blocks.from_law import contact_block, law_block
from symfric.codegen.blocks.variables import Fold
from symfric.codegen.guards import MEANING, Range, Status, parameter_range, range_of
from symfric.codegen.kit import kit_files
from symfric.codegen.runner import footprint
from symfric.codegen.source import header, routines, source
from symfric.emitter.c99 import REALS
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, find_compiler
from symfric.laws import AnyLaw, Population


@final
@dataclass(frozen=True, eq=False)
class Generated:
    """Files written by `generate`.

    Attributes:
        block: the block that the C computes.
        folder: folder of the files.
        reals: names of the floating-point types.
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

    def c(self, real: str) -> CBlock:
        """Return the block as C in the type `real`."""
        return CBlock(self.block, REALS[real], self.guards)

    def header(self, real: str) -> Path:
        """Return the header file of the type `real`."""
        return self.folder / f"{self.c(real).name}.h"

    def source(self, real: str) -> Path:
        """Return the source file of the type `real`."""
        return self.folder / f"{self.c(real).name}.c"


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
    stack. All file names except CMakeLists.txt, which is the same for all blocks, begin with the
    name of the block, so that several packages may share a folder and a program.

    The C allocates no memory, includes only math.h, stdbool.h and, for the guards, stdint.h and
    string.h, contains no data except constants, and compiles without warnings under -Wall -Wextra
    -Wpedantic -Wconversion -Wdouble-promotion, also as C++.

    Args:
        law: a friction law, see `law_block`; a population, see `contact_block`; or a block.
        out: folder, created if missing; files of the same names are replaced.
        name: C identifier; default the name of the law.
        real: "double", "float" or both.
        h: step size [s] as a constant instead of a parameter (laws with states).
        free, fold: parameters that remain variable at run time, or that become constants, see
            `law_block`; by default, parameters are fields of a struct, with a constant struct of
            defaults. The parameters of a population are always constants.
        turning: True for a rotary contact: the texts use rad/s and N m.
        guards: clamp inputs to their ranges, replace values that are not finite, and report both in
            a status; see `symfric.codegen.guards`. Valid values keep all their bits.
        kit: False to write only sources and manifest, without sizes.

    Raises:
        ValueError: bad input, a law that has no step, an operation that C99 lacks, or a number
            outside the range of float (computed numbers below it become the smallest nonzero one).
    """
    given = (real,) if isinstance(real, str) else checks.many("codegen: real", real, "types")
    checks.check_names("codegen: real", given, REALS)
    reals = tuple(dict.fromkeys(given))
    folder = checks.path("codegen: out", out)
    checks.flag("codegen: guards", guards)
    if not reals:
        raise ValueError("codegen: real: expected double, float or both, got none")
    chosen = {"name": name, "h": h, "free": free, "fold": fold, "turning": turning or None}
    block = _block(law, {option: value for option, value in chosen.items() if value is not None})
    several = [CBlock(block, REALS[n], guards) for n in reals]
    texts: dict[str, str] = {}
    for c in several:
        for value in block.constants.values():
            c.real.literal(value)  # raises an error if rounded to 0 or infinity
        texts |= {f"{c.name}.h": header(c), f"{c.name}.c": source(c)}
    texts |= kit_files(several) if kit else {}
    for file, text in texts.items():
        write_text(folder / file, text)
    content = manifest(several, texts)
    compiler = find_compiler() if kit else None
    if compiler is not None:
        for c in several:
            with suppress(CompileError):  # no sizes of C that does not compile; see `verify`
                sizes = footprint(c, folder, compiler)
                content["real"][c.real.name]["measured"] = {"compiler": str(compiler), **sizes}
    files = tuple(folder / file for file in (*texts, f"{block.name}_manifest.json"))
    write_text(files[-1], json.dumps(content, indent=2) + "\n")
    return Generated(block, folder, reals, files, content, guards)


def with_cores(generated: Generated, measured: Sequence[Mapping[str, Any]]) -> Generated:
    """Add measurements on other cores to the manifest and to its file.

    Args:
        measured: results of `symfric.embedded` for each core and type, see `Measured.to_dict`.
    """
    if not measured:
        return generated
    content = {**generated.manifest, "cores": [dict(row) for row in measured]}
    write_text(generated.files[-1], json.dumps(content, indent=2) + "\n")
    return replace(generated, manifest=content)


def _block(law: AnyLaw | Block, options: dict[str, Any]) -> Block:
    """Return the block of a law with the given `options`, all of which must apply."""
    allowed, what, make = ("name", "h", "free", "fold", "turning"), "a law", law_block
    if isinstance(law, Block):
        allowed, what = (), "a block, which has its own"
    elif isinstance(law, Population):
        what = "a population, whose numbers are constants and which slides"
        allowed, make = ("name", "h"), contact_block
    wrong = [option for option in options if option not in allowed]
    if wrong:
        raise ValueError(f"codegen: {', '.join(wrong)}: expected with a law only, got {what}")
    return law if isinstance(law, Block) else make(law, **options)  # pyright: ignore[reportArgumentType]


def manifest(several: Sequence[CBlock], texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of NAME_manifest.json.

    Args:
        several: the block in each of its types.
        texts: contents of the files of the package, by file name.
    """
    block, guards = several[0].block, several[0].guards
    parameters = [(v, parameter_range(v) if guards else None) for v in block.parameters]
    inputs = [(v, range_of(v) if guards else None) for v in block.inputs]
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
        "parameters": [_variable(v, "default", within) for v, within in parameters],
        "inputs": [_variable(v, "safe", within) for v, within in inputs],
        "outputs": [
            {"name": name, "unit": output.unit, "doc": output.doc}
            for name, output in block.outputs.items()
        ],
        "constants": dict(block.constants),
        "guards": guards,
        "status": {str(s.name): {"bit": int(s), "meaning": MEANING[s]} for s in Status if guards},
        "misra_c_2012_deviations": SHEET["misra"],
        "real": {c.real.name: _described(c) for c in several},
        "files": {
            name: {"bytes": len(data := text.encode()), "sha256": sha256(data).hexdigest()}
            for name, text in texts.items()
        },
    }


def _variable(variable: Variable, start: str, within: Range | None) -> dict[str, Any]:
    """Return the entry of a variable: meaning, unit, range (as enforced by guards) and start."""
    low, high, safe = within or (variable.lower, variable.upper, float(variable.start))
    return {
        "name": variable.name,
        "unit": variable.unit,
        "doc": variable.doc,
        "nominal": variable.nominal,
        "range": [bound if isfinite(bound) else None for bound in (low, high)],
        start: safe,
    }


def _described(c: CBlock) -> dict[str, Any]:
    return {
        "header": f"{c.name}.h",
        "source": f"{c.name}.c",
        "bytes": {
            group: c.real.size * sum(row.length for row in rows)
            for group, rows in c.block.members.items()
        },
        "functions": {
            routine.name: {
                "prototype": f"{' '.join(routine.head.split())};",
                "operations": routine.operations,
                "calls": dict(sorted(routine.calls.items())),
            }
            for routine in routines(c)
        },
    }
