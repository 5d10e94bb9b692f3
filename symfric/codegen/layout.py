"""Block as C in one floating-point type: names, calls and text shared by the generated files.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types may be used in one program. The C allocates nothing and its only data are the constant
defaults, so one block serves any number of joints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from string import Template
from textwrap import wrap
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.emitter.c99 import Real


@final
@dataclass(frozen=True, eq=False)
class CBlock:
    """Block as C in one floating-point type.

    Attributes:
        guards: True if the C checks its numbers, see `symfric.codegen.guards`.
    """

    block: Block
    real: Real
    guards: bool = True

    @property
    def name(self) -> str:
        """Prefix of all names and files."""
        return f"{self.block.name}_{self.real.suffix}"

    @cached_property
    def start(self) -> NDArray[np.float64]:
        """Start values of the states, rounded to the type."""
        return self.real.rounded([float(v.start) for v in self.block.states])

    @cached_property
    def default(self) -> NDArray[np.float64]:
        """Default parameters, rounded to the type."""
        return self.real.rounded([float(v.start) for v in self.block.parameters])

    def call(
        self, pointers: Mapping[str, str], inputs: Sequence[str], status: str = "&status"
    ) -> str:
        """Return the C expression that calls one step.

        Args:
            pointers: pointer to each struct, by group.
            inputs: arguments of a function of scalars.
            status: pointer to the status, in which a guarded function of scalars sets bits.
        """
        structs = [pointers[group] for group in GROUPS if group in self.block.members]
        if self.block.is_function:
            arguments = [*inputs, *structs, *[status] * self.guards]
            return f"{self.name}({', '.join(arguments)})"
        return f"{self.name}_step({', '.join(structs)})"

    @property
    def sizes(self) -> dict[str, str | int]:
        """Names and sizes for templates that call `flat_step`."""
        counts = {
            "states": len(self.block.states),
            "params": len(self.block.parameters),
            "inputs": len(self.block.inputs),
            "outputs": len(self.block.outputs),
        }
        return {"name": self.name, "real": self.real.name, "step": self.flat_step} | counts

    @property
    def signals(self) -> list[str]:
        """Columns of a run: states after a step, outputs, states after each reset, status."""
        states = [v.name for v in self.block.states]
        later = [f"{reset}.{name}" for reset in self.block.resets for name in states]
        return [*states, *self.block.outputs, *later, *["status"] * self.guards]

    @property
    def casts(self) -> dict[str, str]:
        """Casts of the pointers `state`, `param`, `in` and `out` from flat arrays to structs."""
        return {
            group: f"({'const ' * (group in GROUPS[1:3])}{self.name}_{group}_t *){group}"
            for group in GROUPS
        }

    @property
    def flat_step(self) -> str:
        """Statement of a step on flat arrays `state`, `param`, `in`, `out`, and on `status`."""
        inputs = [f"in[{k}]" for k in range(len(self.block.inputs))]
        result = "*out = " if self.block.is_function else "*status |= " * self.guards
        return f"{result}{self.call(self.casts, inputs, 'status')};"


WIDTH = 100

TEMPLATES = Path(__file__).with_name("templates")
"""Folder of the fixed text of generated files."""


class _AtTemplate(Template):
    """Template with placeholders @name, since $ has a meaning in CMake."""

    delimiter = "@"


def filled(template: Path, **values: object) -> str:
    """Return the text of a template file with a value in each placeholder @name."""
    return _AtTemplate(template.read_text(encoding="utf-8")).substitute(values)


def indented(lines: Sequence[str], depth: int = 1) -> str:
    """Return lines of C, indented by `depth` levels."""
    return "\n".join("    " * depth + line for line in lines)


def banner(block: Block, file: str) -> list[str]:
    """Return the first lines of a file: generator and licence."""
    return [
        f"{file}: C99 made by symfric {version('symfric')} with CasADi {version('casadi')}, "
        f"model {block.fingerprint}.",
        "This generated code is yours. SPDX-License-Identifier: MIT-0",
    ]


def head(block: Block, file: str) -> str:
    """Return the first lines of a C file as a comment that is not closed."""
    return block_comment(banner(block, file)).removesuffix("\n */")


def block_comment(lines: Sequence[str]) -> str:
    """Return lines of text as one C comment."""
    return "/* " + "\n".join(f" * {comment(line)}".rstrip() for line in lines)[3:] + "\n */"


def comment(text: str) -> str:
    """Return `text` without character pairs that begin or end a C comment."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def folded(line: str, margin: str) -> str:
    """Return a long line wrapped at blanks; the continuation lines are indented further."""
    text = line.lstrip(" ")
    margin += " " * (len(line) - len(text))
    lines = wrap(
        text, WIDTH, initial_indent=margin, subsequent_indent=f"{margin}    ",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
    return "\n".join(lines)
