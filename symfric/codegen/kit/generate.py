"""The files of a block: header and source of each floating point type, and the kit round them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, final

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.folding import Fold
from symfric.codegen.blocks.from_law import law_block
from symfric.codegen.blocks.from_population import contact_block
from symfric.codegen.kit.cmake import EVERY, of_block
from symfric.codegen.kit.footprint import footprint
from symfric.codegen.kit.loader import loader
from symfric.codegen.kit.manifest import manifest
from symfric.codegen.kit.self_check import table, unit_test, vector_header
from symfric.codegen.kit.simulink import wrapper
from symfric.codegen.kit.vectors import vectors
from symfric.codegen.writing.header import header
from symfric.codegen.writing.layout import prefix
from symfric.codegen.writing.source import source
from symfric.emitter.c99 import REALS, Real
from symfric.foundation import checks
from symfric.foundation.compiler import CompileError, find_compiler
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
        manifest: content of NAME_manifest.json.
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
    kit: bool = True,
) -> Generated:
    """Write a friction law, or any block, as C99.

    For each type `NAME_f64.h`, whose head is the data sheet, and `NAME_f64.c` (float: `f32`), and
    what makes a kit of them: test vectors and a unit test in C (`NAME_f64_test.c`, `..._vectors.h`,
    `.csv`), `CMakeLists.txt` and `NAME_block.cmake`, a loader for Python without symfric
    (`NAME_ctypes.py`), an S-function for Simulink (`NAME_sfun.c`) and `NAME_manifest.json` with
    meanings, units, ranges, hashes, operation counts and, where there is a compiler, sizes and
    stack. All names but CMakeLists.txt, which is the same for all, begin with that of the block, so
    that several kits may share a folder and a program.

    The C allocates nothing, includes only math.h, stdbool.h and, for the guards, stdint.h and
    string.h, has no data but constants, and compiles without warnings under -Wall -Wextra
    -Wpedantic -Wconversion -Wdouble-promotion, also as C++.

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
        kit: False leaves sources and manifest, without sizes.

    Raises:
        ValueError: bad input, a law that has no step, an operation that C99 lacks, a number
            outside the range of float (a computed one below it becomes the smallest that is not 0).
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
    _check_constants(block, reals)
    texts = _sources(block, reals, guards) | (_kit(block, reals, guards) if kit else {})
    for file, text in texts.items():
        write_text(folder / file, text)
    content = manifest(block, reals, guards, texts, _measured(block, reals, folder) if kit else {})
    last = f"{block.name}_manifest.json"
    write_text(folder / last, json.dumps(content, indent=2) + "\n")
    files = tuple(folder / file for file in (*texts, last))
    return Generated(block, folder, names, files, content, guards)


def _check_constants(block: Block, reals: Sequence[Real]) -> None:
    """Refuse numbers that were given and would be rounded to 0 or infinity."""
    for real in reals:
        for value in block.constants.values():
            real.literal(value)


def with_cores(generated: Generated, measured: Sequence[Mapping[str, Any]]) -> Generated:
    """The same with what was measured on other cores in its manifest, also in the file.

    Args:
        measured: of each core and type what `symfric.embedded` found, as `Measured.to_dict`.
    """
    if not measured:
        return generated
    content = {**generated.manifest, "cores": [dict(row) for row in measured]}
    write_text(generated.files[-1], json.dumps(content, indent=2) + "\n")
    return replace(generated, manifest=content)


def _sources(block: Block, reals: Sequence[Real], guards: bool) -> dict[str, str]:
    """Header and source of each type."""
    texts: dict[str, str] = {}
    for real in reals:
        texts[f"{prefix(block, real)}.h"] = header(block, real, guards)
        texts[f"{prefix(block, real)}.c"] = source(block, real, guards)
    return texts


def _kit(block: Block, reals: Sequence[Real], guards: bool) -> dict[str, str]:
    """What stands beside the sources: the proof for the target, builds, loaders."""
    texts: dict[str, str] = {}
    for real in reals:
        stem, rows = prefix(block, real), vectors(block, real, guards)
        texts[f"{stem}_test.c"] = unit_test(block, real, guards)
        texts[f"{stem}_vectors.h"] = vector_header(rows, guards)
        texts[f"{stem}_vectors.csv"] = table(rows, guards)
    texts[f"{block.name}_block.cmake"] = of_block(block, reals)
    texts["CMakeLists.txt"] = EVERY
    texts[f"{block.name}_ctypes.py"] = loader(block, reals, guards)
    texts[f"{block.name}_sfun.c"] = wrapper(block, reals, guards)
    return texts


def _measured(block: Block, reals: Sequence[Real], folder: Path) -> dict[str, dict[str, Any]]:
    """Sizes and stack by type, as the compiler of this machine makes them, if it has one."""
    compiler = find_compiler()
    if compiler is None:
        return {}
    found: dict[str, dict[str, Any]] = {}
    for real in reals:
        try:
            sizes = footprint(block, real, folder, compiler)
        except CompileError:  # one that cannot compile makes no sizes; `verify` says why
            continue
        found[real.name] = {"measured": {"compiler": str(compiler), **sizes.to_dict()}}
    return found


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
