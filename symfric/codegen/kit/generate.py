"""Files of generated C: header and source a floating point type, and a manifest."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, final

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.folding import Fold
from symfric.codegen.blocks.from_law import law_block
from symfric.codegen.blocks.from_population import contact_block
from symfric.codegen.writing.header import header
from symfric.codegen.writing.layout import members, prefix
from symfric.codegen.writing.routines import routines
from symfric.codegen.writing.source import source
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.parameters import check_names
from symfric.laws import AnyLaw, Population


@final
@dataclass(frozen=True, eq=False)
class Generated:
    """What `generate` wrote.

    Attributes:
        block: what the C computes.
        folder: where the files are.
        reals: floating point types, by name.
        files: all files, the manifest last.
        manifest: content of manifest.json.
        guards: whether the C has guards, see `symfric.codegen.writing.guards`.
    """

    block: Block
    folder: Path
    reals: tuple[str, ...]
    files: tuple[Path, ...]
    manifest: Mapping[str, Any]
    guards: bool = True

    def header(self, real: str) -> Path:
        """The header file of the type `real`."""
        return self.folder / f"{prefix(self.block, REALS[real])}.h"

    def source(self, real: str) -> Path:
        """The source file of the type `real`."""
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
) -> Generated:
    """Write a friction law, or any block, as C99.

    For each type `NAME_f64.h`, `NAME_f64.c` (float: `f32`), and `manifest.json` with names, units,
    sizes and operation counts. The C allocates nothing, includes only math.h, stdbool.h and, for
    the guards, stdint.h and string.h, has no data but constants, and compiles without warnings
    under -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion, also as C++. The C of several
    blocks may share a folder and a program; the manifest is then that of the last one.

    Args:
        law: a friction law, see `law_block`; a population, see `contact_block`; or a block.
        out: folder, made where it is missing; files of the same names are replaced.
        name: C identifier; default the name of the law.
        real: "double", "float" or both.
        h: step size [s] as a constant instead of a parameter (laws with states).
        free, fold: parameters that stay variable at run time, or become constants, see `law_block`;
            by default they are fields of a struct with a constant default beside it. Those of a
            population are constants.
        turning: the law is that of a contact that turns: rad/s and N m in its texts.
        guards: clamp inputs to their ranges, repair what is not finite, and return a status that
            says so; see `symfric.codegen.writing.guards`. What is valid is not changed by a bit.

    Raises:
        ValueError: bad input, a law that has no step, an operation that C99 lacks, a
            constant outside the range of float.
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
    texts: dict[str, str] = {}
    for kind in (REALS[n] for n in names):
        texts[f"{prefix(block, kind)}.h"] = header(block, kind, guards)
        texts[f"{prefix(block, kind)}.c"] = source(block, kind, guards)
    manifest = _manifest(block, [REALS[n] for n in names], guards)
    texts["manifest.json"] = json.dumps(manifest, indent=2) + "\n"
    for file, text in texts.items():
        write_text(folder / file, text)
    return Generated(block, folder, names, tuple(folder / file for file in texts), manifest, guards)


def _block(law: AnyLaw | Block, options: dict[str, Any]) -> Block:
    """The block of a law with the `options` that were given, all of which must apply."""
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


def _manifest(block: Block, reals: Sequence[Real], guards: bool) -> dict[str, Any]:
    return {
        "name": block.name,
        "model": block.fingerprint,
        "symfric": version("symfric"),
        "casadi": version("casadi"),
        "states": [{"name": v.name, "unit": v.unit, "start": float(v.start)} for v in block.states],
        "parameters": [
            {"name": v.name, "unit": v.unit, "default": float(v.start), "doc": v.doc}
            for v in block.parameters
        ],
        "inputs": [{"name": v.name, "unit": v.unit, "doc": v.doc} for v in block.inputs],
        "outputs": [
            {"name": name, "unit": output.unit, "doc": output.doc}
            for name, output in block.outputs.items()
        ],
        "constants": dict(block.constants),
        "guards": guards,
        "real": {real.name: _described(block, real, guards) for real in reals},
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
