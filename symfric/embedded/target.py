"""Cortex-M cores, the tools that compile and run code for them, and programs under QEMU.

The main program calls a block step by step and says by semihosting what each step cost and gave:
numbers as words of eight hexadecimal digits, one a line, behind a line with their name. Steps are
timed by SysTick, which under QEMU's -icount counts instructions and nothing else. Start-up code,
linker script and main programs are files in `sources`.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from re import fullmatch
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.layout import CBlock, filled
from symfric.codegen.source import header, source
from symfric.emitter.c99 import REALS
from symfric.foundation.files import write_text
from symfric.foundation.programs import CompileError, Compiler, ProgramError, finished

BY = ("symfric", "casadi", "casadi, functions of float")
"""Who writes the C: we; CasADi, whose code of float calls tanh, exp, fmax of double; CasADi with a
header before it that maps them to those of float."""

_MATH = (
    *("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos"),
    *("cosh", "erf", "exp", "expm1", "fabs", "floor", "fmax", "fmin", "fmod", "hypot", "log"),
    *("log1p", "pow", "sin", "sinh", "sqrt", "tan", "tanh"),
)


@final
@dataclass(frozen=True, eq=False)
class Subject:
    """Code with one step of a block in it.

    Attributes:
        source: the file to compile.
        parts: of the main program, the places of `sources/measured.c`.
    """

    source: Path
    parts: Mapping[str, str]


def own(block: Block, real: str, folder: Path, *, guards: bool) -> Subject:
    """Our C, written into `folder`, and its call."""
    c = CBlock(block, REALS[real], guards)
    name = c.name
    write_text(folder / f"{name}.h", header(c))
    write_text(folder / f"{name}.c", source(c))
    pointers = {
        "state": "&state",
        "param": f"&{name}_default",
        "in": f"(const {name}_in_t *)U[k]",
        "out": f"({name}_out_t *)(Y[k] + {len(block.states)})",
    }
    step = c.call(pointers, [f"U[k][{i}]" for i in range(len(block.inputs))])
    declarations, start, keep = ["unsigned int status;"], "status = 0u;", "(void)k;"
    if block.states:
        declarations.append(f"{name}_state_t state;")
        start += f" {name}_init(&state, &{name}_start);"
        keep = "memcpy(Y[k], &state, sizeof state);"
    sizes = [f"sizeof({name}_state_t)"] * bool(block.states)
    sizes += [f"sizeof({name}_param_t)"] * bool(block.parameters)
    return Subject(
        folder / f"{name}.c",
        {
            "include": f'#include "{name}.h"',
            "declarations": "\n".join(f"static {line}" for line in declarations),
            "start": start,
            "step": f"{'Y[k][0] = ' if block.is_function else 'status |= ' * guards}{step};",
            "keep": keep,
            "data": " + ".join(sizes) or "0u",
        },
    )


def by_casadi(block: Block, real: str, folder: Path, *, functions_of_float: bool) -> Subject:
    """CasADi's C of the same step, written into `folder`."""
    options = {
        "casadi_real": real,
        "casadi_int": "int",
        "static_aux": True,
        "include_math": not functions_of_float,
    }
    generator = ca.CodeGenerator("casadi_step", options)
    generator.add(block.step)
    text = generator.dump()
    if functions_of_float:
        renamed = "".join(f"#define {name} {name}f\n" for name in _MATH)
        text = f"#include <math.h>\n{renamed}\n{text}"
    write_text(folder / "casadi_step.c", text)
    return Subject(folder / "casadi_step.c", _casadi_parts(block, real))


def _casadi_parts(block: Block, real: str) -> dict[str, str]:
    f, n = block.step, len(block.states)
    p, x = (
        literals(np.array([v.start for v in group] or [0.0], dtype=float), real)
        for group in (block.parameters, block.states)
    )
    static = [
        f"const {real} X0[] = {{{x}}}, P[] = {{{p}}};",
        f"{real} X[{n + 1}], XN[{n + 1}], W[{f.sz_w() + 1}];",
        f"int IW[{f.sz_iw() + 1}];",
        f"const {real} *ARG[{f.sz_arg()}];",
        f"{real} *RES[{f.sz_res()}];",
    ]
    prototype = f"int step(const {real} **arg, {real} **res, int *iw, {real} *w, int mem);\n"
    return {
        "include": "",
        "declarations": prototype + "\n".join(f"static {line}" for line in static),
        "start": "memcpy(X, X0, sizeof X0);",
        "step": f"ARG[0] = X; ARG[1] = P; ARG[2] = U[k]; RES[0] = XN; RES[1] = Y[k] + {n}; "
        f"step(ARG, RES, IW, W, 0); memcpy(X, XN, {n} * sizeof X[0]);",
        "keep": f"memcpy(Y[k], X, {n} * sizeof X[0]);",
        "data": "sizeof X + sizeof XN + sizeof W + sizeof IW + sizeof ARG + sizeof RES + sizeof P",
    }


def literals(values: np.ndarray, real: str) -> str:
    """Numbers as constants of C."""
    form = "{:.9e}f" if real == "float" else "{:.17e}"
    return ", ".join(form.format(float(value)) for value in values)


@final
@dataclass(frozen=True)
class Core:
    """Cortex-M core.

    Attributes:
        name: in short.
        title: in full, with its floating point unit.
        options: of gcc.
        machine: QEMU's board whose core runs this code.
    """

    name: str
    title: str
    options: tuple[str, ...]
    machine: str


_SOFT = "-mfloat-abi=soft"
_HARD = "-mfloat-abi=hard"

CORES = {
    core.name: core
    for core in (
        Core("m0plus", "Cortex-M0+, no FPU", ("-mcpu=cortex-m0plus", _SOFT), "mps2-an385"),
        Core("m3", "Cortex-M3, no FPU", ("-mcpu=cortex-m3", _SOFT), "mps2-an385"),
        Core(
            "m4f",
            "Cortex-M4F, FPU of float",
            ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", _HARD),
            "mps2-an386",
        ),
        Core(
            "m7",
            "Cortex-M7, FPU of double",
            ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", _HARD),
            "mps2-an500",
        ),
    )
}
"""By name. Code for the M0+ runs on QEMU's M3: ARMv6-M is a part of ARMv7-M, instruction by
instruction, so that the counts are the same; QEMU's one board with an M0 has 16 kB of RAM."""

CLOCK = 25e6
"""Of SysTick on the boards [Hz]."""


GCC, QEMU, NEWLIB = "arm-none-eabi-gcc", "qemu-system-arm", "newlib for arm-none-eabi"

PACKAGES = {
    GCC: "gcc-arm-none-eabi",
    NEWLIB: "libnewlib-arm-none-eabi",
    QEMU: "qemu-system-arm",
}
"""Tool -> package of Debian and Ubuntu."""

LIBRARY_PATIENCE = 10.0
"""Seconds in which a compiler says where its library is."""


@final
@dataclass(frozen=True)
class Tools:
    """Cross compiler, and the path of the emulator."""

    gcc: Compiler
    qemu: str


@final
@dataclass(frozen=True)
class Absent:
    """Names of the tools that are missing."""

    names: tuple[str, ...]

    @property
    def advice(self) -> str:
        """Sentence with the absent tools and how to install them."""
        packages = " ".join(PACKAGES[name] for name in self.names)
        return (
            f"{', '.join(self.names)} not found; on Debian and Ubuntu: "
            f"apt-get install --no-install-recommends {packages}"
        )


def find_tools() -> Tools | Absent:
    """Return the tools in PATH, or which of them are not there."""
    gcc, qemu = shutil.which(GCC), shutil.which(QEMU)
    if gcc is not None and qemu is not None and _has_library(gcc):
        return Tools(Compiler((gcc,)), qemu)
    missing = [name for name, path in ((GCC, gcc), (QEMU, qemu)) if path is None]
    if gcc is None or not _has_library(gcc):
        missing.insert(1 if gcc is None else 0, NEWLIB)
    return Absent(tuple(missing))


def _has_library(gcc: str) -> bool:
    """Return True if the compiler finds libm: it then prints a path and not only the name."""
    try:
        said = finished((gcc, "-print-file-name=libm.a"), limit=LIBRARY_PATIENCE).output.strip()
    except ProgramError:
        return False
    return said not in (b"", b"libm.a")


Array = NDArray[np.float64]

SOURCES = Path(__file__).with_name("sources")
"""Folder of the C and the linker script round the code that is measured."""

FLAGS = ("-mthumb", "-std=gnu99", "-ffunction-sections", "-fdata-sections", "-ffp-contract=off")
"""For every core."""

SHIFT = 7
"""Instruction takes 2^7 ns of QEMU's time: 3.2 ticks of SysTick, whose 24 bits are enough for
5 million instructions."""

WORD = "[0-9a-f]{8}"

PATIENCE = 120.0
"""Seconds that a program may run."""


@final
@dataclass(frozen=True, eq=False)
class Said:
    """Output of a program.

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
    """Core, the tools for it and options of the compiler."""

    core: Core
    tools: Tools
    flags: Sequence[str]

    def linked(self, folder: Path, main: str, sources: Sequence[Path], *flags: str) -> Path:
        """Return an image of a main program and `sources`, the first of which is what is measured.

        Raises:
            CompileError: the compiler refuses it.
        """
        write_text(folder / "target.c", main)
        gcc, options = self.tools.gcc, (*self.core.options, *FLAGS, *self.flags, *flags)
        names = ("block", *(f"more_{k}" for k in range(1, len(sources))), "startup", "target")
        objects = [str(folder / f"{name}.o") for name in names]
        files = (*sources, SOURCES / "startup.c", folder / "target.c")
        for file, item in zip(files, objects, strict=True):
            gcc.run(*options, f"-I{folder}", "-c", str(file), "-o", item)
        image = folder / "image.elf"
        linking = ("-nostartfiles", f"-T{SOURCES / 'memory.ld'}", "-Wl,--gc-sections")
        gcc.run(*options, *linking, "--specs=nosys.specs", *objects, "-lm", "-o", str(image))
        return image

    def heard(self, image: Path) -> dict[str, NDArray[np.uint32]]:
        """Run an image under QEMU; its words by the name before them.

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
    main = filled(
        SOURCES / "measured.c",
        real=real,
        steps=len(inputs),
        inputs=max(inputs.shape[1], 1),
        columns=columns,
        values=",\n".join(rows),
        **subject.parts,
    )
    return target.linked(subject.source.parent, main, (subject.source,))


def said(words: Mapping[str, NDArray[np.uint32]], real: str, columns: int) -> Said:
    """Output of a measured program."""
    kind = REALS[real].kind
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
    """Return the words behind each name, up to "end"."""
    found: dict[str, list[int]] = {}
    for line in lines[: lines.index("end")]:
        if fullmatch(WORD, line):
            found[next(reversed(found))].append(int(line, 16))
        else:
            found[line] = []
    return {name: np.array(words, dtype=np.uint32) for name, words in found.items()}
