"""The files of a unit: C, the binary of this platform, and the archive that holds them."""

import platform
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final
from zipfile import ZIP_DEFLATED, ZipFile

from symfric.foundation.compiler import CompileError, Compiler, find_compiler
from symfric.foundation.files import written

SOURCES = Path(__file__).with_name("sources")
FLAGS = (
    "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared",
    "-Werror=implicit-function-declaration",
)  # fmt: skip
"""Without contraction to fused multiply-add the steps have the bits of `simulate`."""
MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
SYSTEMS = {"Linux": "linux", "Darwin": "darwin", "Windows": "windows"}
OLD = {
    "x86_64-linux": "linux64", "x86-linux": "linux32", "x86_64-windows": "win64",
    "x86-windows": "win32", "x86_64-darwin": "darwin64",
}  # fmt: skip
"""What version 2.0 calls a platform; one that it does not know keeps its name of 3.0."""
ENDINGS = {"windows": ".dll", "darwin": ".dylib"}


def platform_name(fmi: int) -> str:
    """What the standard calls this platform."""
    machine = platform.machine().lower()
    system = SYSTEMS.get(platform.system(), platform.system().lower())
    name = f"{MACHINES.get(machine, machine)}-{system}"
    return OLD.get(name, name) if fmi == 2 else name


def shared_name(identifier: str) -> str:
    """File name of a binary here."""
    system = SYSTEMS.get(platform.system(), "")
    return identifier + ENDINGS.get(system, ".so")


def fixed_text(name: str) -> str:
    """One of the C files that all units share."""
    return (SOURCES / name).read_text(encoding="utf-8")


def sources(sizes: str, model: str, fmi: int, fixed: bool, exchange: bool) -> dict[str, str]:
    """Name -> text of the C of a unit; `all.c` includes the others.

    Args:
        sizes, model: C of the model.
        fmi: version, 2 or 3.
        fixed: whether its steps are.
        exchange: whether it is for model exchange, and makes no steps.
    """
    steps = "exchange.c" if exchange else "fixed.c" if fixed else "adaptive.c"
    shared = ["consistent.c", steps, "unit.c", "rates.c" if exchange else "communication.c"]
    shared += ["derivatives.c", "states.c"]
    kinds = ("exchange", "cosimulation") if exchange else ("cosimulation", "exchange")
    own = [f"fmi{fmi}.c", f"fmi{fmi}_{kinds[0]}.c"]
    own += ["fmi3_absent.c", f"fmi3_no_{kinds[1]}.c"] if fmi == 3 else []
    texts = {"sizes.h": sizes, "model.c": model}
    fixed_files = ("memory.h", "numbers.c", *shared, f"fmi{fmi}.h", *own)
    texts |= {name: fixed_text(name) for name in fixed_files}
    included = [f"fmi{fmi}.h", "sizes.h", "memory.h", "numbers.c", "model.c", *shared, *own]
    system = ("float.h", "math.h", "stdbool.h", "stdio.h", "stdlib.h", "string.h")
    texts["all.c"] = (
        "/* The whole unit: the one file to compile. */\n\n"
        + "".join(f"#include <{name}>\n" for name in system)
        + "\n"
        + "".join(f'#include "{name}"\n' for name in included)
    )
    return texts


@final
@dataclass(frozen=True, eq=False)
class Binary:
    """The library of this platform, or why there is none."""

    name: str
    content: bytes
    missing: str = ""


def compiled(texts: Mapping[str, str], identifier: str, fmi: int) -> Binary:
    """Compile the unit for this platform; without a compiler the sources alone are handed out.

    Raises:
        CompileError: the compiler refuses the C.
    """
    compiler = find_compiler()
    name = f"binaries/{platform_name(fmi)}/{shared_name(identifier)}"
    if sys.platform == "win32":
        return Binary(name, b"", "units are compiled on Linux and macOS; compile sources/all.c")
    if compiler is None:
        return Binary(name, b"", "no C compiler ($CC, gcc, clang or cc) was found")
    with tempfile.TemporaryDirectory(prefix="symfric-fmu-") as folder:
        place = Path(folder)
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
        target = place / shared_name(identifier)
        compile_unit(compiler, place, target)
        return Binary(name, target.read_bytes())


def compile_unit(compiler: Compiler, folder: Path, target: Path, *more: str) -> list[str]:
    """Compile `all.c` in `folder` to a library; returns the warnings.

    Raises:
        CompileError: the compiler refuses it.
    """
    warned = compiler.warnings(*FLAGS, *more, str(folder / "all.c"), "-o", str(target), "-lm")
    if not target.exists():
        raise CompileError(f"{compiler} wrote nothing")
    return warned


def packed(
    path: Path, description: str, build: str, texts: Mapping[str, str], binary: Binary
) -> int:
    """Write the archive, whole or not at all; returns its size in bytes."""
    with written(path) as temporary:
        with ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description)
            for name, text in texts.items():
                archive.writestr(f"sources/{name}", text)
            if build:
                archive.writestr("sources/buildDescription.xml", build)
            if binary.content:
                archive.writestr(binary.name, binary.content)
        return temporary.stat().st_size
