"""From C to an image for a core, and what it says when QEMU runs it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
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

PATIENCE = 120.0
"""Seconds that a program may run."""


@final
@dataclass(frozen=True, eq=False)
class Said:
    """What a program said.

    Attributes:
        instructions: of every step, shape (steps,).
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
class Image:
    """A linked program, and how its results are to be read: type and number of columns."""

    path: Path
    real: str
    columns: int


def built(
    subject: Subject,
    run: tuple[str, Array, int],
    core: Core,
    tools: Tools,
    flags: Sequence[str],
) -> Image:
    """Compile and link what calls the subject with inputs.

    Args:
        run: floating point type, inputs (steps, inputs), number of columns of the results.

    Raises:
        CompileError: the compiler refuses it.
    """
    real, inputs, columns = run
    folder = subject.source.parent
    rows = [f"{{{literals(row, real) or '0'}}}" for row in inputs]
    parts = {
        "real": real,
        "steps": str(len(inputs)),
        "inputs": str(max(inputs.shape[1], 1)),
        "columns": str(columns),
        "values": ",\n".join(rows),
    }
    texts = {
        "startup.c": STARTUP,
        "memory.ld": LINKER,
        "target.c": MAIN.substitute(parts | dict(subject.parts)),
    }
    for name, text in texts.items():
        write_text(folder / name, text)
    options = (*core.options, *FLAGS, *flags)
    for source, target in (
        (subject.source, "block.o"),
        (folder / "target.c", "target.o"),
        (folder / "startup.c", "startup.o"),
    ):
        tools.gcc.run(*options, f"-I{folder}", "-c", str(source), "-o", str(folder / target))
    objects = [str(folder / f"{name}.o") for name in ("startup", "target", "block")]
    image = folder / "image.elf"
    linking = ("-nostartfiles", f"-T{folder / 'memory.ld'}", "-Wl,--gc-sections")
    tools.gcc.run(*options, *linking, "--specs=nosys.specs", *objects, "-lm", "-o", str(image))
    return Image(image, real, columns)


def ran(image: Image, core: Core, tools: Tools) -> Said:
    """Run an image under QEMU.

    Raises:
        CompileError: it does not start, comes to no end, or ends in a fault.
    """
    command = (
        *(tools.qemu, "-M", core.machine, "-display", "none", "-monitor", "none"),
        *("-serial", "none", "-semihosting-config", "enable=on,target=native"),
        *("-icount", f"shift={SHIFT}", "-kernel", str(image.path)),
    )
    try:
        done = finished(command, limit=PATIENCE, name=f"{core.title} under QEMU")
    except ProgramError as error:
        raise CompileError(str(error)) from None
    lines = (done.output.decode(errors="replace") + done.said).split()
    if done.status or "end" not in lines:
        said = " ".join(lines[-8:])
        raise CompileError(f"{core.title}: QEMU ended with status {done.status}: {said}")
    return _read(lines, image)


def _read(lines: Sequence[str], image: Image) -> Said:
    """Words behind the name that stands before them."""
    names = ("stack", "text", "library", "data", "ticks", "rows", "end")
    places = [lines.index(name) for name in names]
    words = {
        name: np.array([int(word, 16) for word in lines[a + 1 : b]], dtype=np.uint32)
        for name, (a, b) in zip(names, pairwise(places), strict=False)
    }
    kind = np.float32 if image.real == "float" else np.float64
    return Said(
        instructions=words["ticks"].astype(float) * (1e9 / CLOCK / 2**SHIFT),
        rows=words["rows"].view(kind).reshape(-1, image.columns).astype(float),
        text=int(words["text"][0]),
        library=int(words["library"][0]),
        data=int(words["data"][0]),
        stack=int(words["stack"][0]),
    )
