"""From C to an image for a core, and what it says when QEMU runs it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from re import fullmatch
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.embedded.cores import CLOCK, Core
from symfric.embedded.firmware import LINKER, MAIN, STARTUP
from symfric.embedded.subjects import Subject, literals
from symfric.embedded.tools import Tools
from symfric.foundation.compiler import CompileError
from symfric.foundation.files import write_text
from symfric.foundation.programs import ProgramError, finished

Array = NDArray[np.float64]

FLAGS = ("-mthumb", "-std=gnu99", "-ffunction-sections", "-fdata-sections", "-ffp-contract=off")
"""For every core."""

SHIFT = 7
"""An instruction takes 2^7 ns of QEMU's time: 3.2 ticks of SysTick, whose 24 bits are enough for
5 million instructions."""

WORD = "[0-9a-f]{8}"

PATIENCE = 120.0
"""Seconds that a program may run."""


@final
@dataclass(frozen=True, eq=False)
class Said:
    """What a program said.

    Attributes:
        instructions: of every step, shape (steps,); each to a third of one, their mean exactly.
        rows: states after every step, and its outputs.
        text, library, data, stack: bytes.
    """

    instructions: Array
    rows: Array
    text: int
    library: int
    data: int
    stack: int


@final
@dataclass(frozen=True, eq=False)
class Target:
    """A core, the tools for it and options of the compiler."""

    core: Core
    tools: Tools
    flags: Sequence[str]

    def linked(self, folder: Path, main: str, sources: Sequence[Path], *flags: str) -> Path:
        """An image of a main program and `sources`, the first of which is what is measured.

        Raises:
            CompileError: the compiler refuses it.
        """
        for name, text in (("startup.c", STARTUP), ("memory.ld", LINKER), ("target.c", main)):
            write_text(folder / name, text)
        gcc, options = self.tools.gcc, (*self.core.options, *FLAGS, *self.flags, *flags)
        names = ("block", *(f"more_{k}" for k in range(1, len(sources))), "startup", "target")
        objects = [str(folder / f"{name}.o") for name in names]
        files = (*sources, folder / "startup.c", folder / "target.c")
        for source, item in zip(files, objects, strict=True):
            gcc.run(*options, f"-I{folder}", "-c", str(source), "-o", item)
        image = folder / "image.elf"
        linking = ("-nostartfiles", f"-T{folder / 'memory.ld'}", "-Wl,--gc-sections")
        gcc.run(*options, *linking, "--specs=nosys.specs", *objects, "-lm", "-o", str(image))
        return image

    def heard(self, image: Path) -> dict[str, NDArray[np.uint32]]:
        """What an image says under QEMU: words by the name before them.

        Raises:
            CompileError: it does not start, comes to no end, or ends in a fault.
        """
        core = self.core
        command = (
            *(self.tools.qemu, "-M", core.machine, "-display", "none", "-monitor", "none"),
            *("-serial", "none", "-semihosting-config", "enable=on,target=native"),
            *("-icount", f"shift={SHIFT}", "-kernel", str(image)),
        )
        try:
            done = finished(command, limit=PATIENCE, name=f"{core.title} under QEMU")
        except ProgramError as error:
            raise CompileError(str(error)) from None
        lines = (done.output.decode(errors="replace") + done.said).split()
        if done.status or "end" not in lines:
            said = " ".join(lines[-8:])
            raise CompileError(f"{core.title}: QEMU ended with status {done.status}: {said}")
        return _words(lines)


def built(subject: Subject, real: str, inputs: Array, columns: int, target: Target) -> Path:
    """Compile and link what calls the subject with `inputs` and keeps rows of `columns` numbers.

    Raises:
        CompileError: the compiler refuses it.
    """
    rows = [f"{{{literals(row, real) or '0'}}}" for row in inputs]
    parts = {
        "real": real,
        "steps": str(len(inputs)),
        "inputs": str(max(inputs.shape[1], 1)),
        "columns": str(columns),
        "values": ",\n".join(rows),
    }
    return target.linked(
        subject.source.parent, MAIN.substitute(parts | dict(subject.parts)), (subject.source,)
    )


def said(words: Mapping[str, NDArray[np.uint32]], real: str, columns: int) -> Said:
    """What a measured program said."""
    kind = np.float32 if real == "float" else np.float64
    ticks = words["ticks"] - words["idle"].mean()
    return Said(
        instructions=ticks * (1e9 / CLOCK / 2**SHIFT),
        rows=words["rows"].view(kind).reshape(-1, columns).astype(float),
        text=int(words["text"][0]),
        library=int(words["library"][0]),
        data=int(words["data"][0]),
        stack=int(words["stack"][0]),
    )


def _words(lines: Sequence[str]) -> dict[str, NDArray[np.uint32]]:
    """The words behind each name, up to "end"."""
    found: dict[str, list[int]] = {}
    for line in lines[: lines.index("end")]:
        if fullmatch(WORD, line):
            found[next(reversed(found))].append(int(line, 16))
        else:
            found[line] = []
    return {name: np.array(words, dtype=np.uint32) for name, words in found.items()}
