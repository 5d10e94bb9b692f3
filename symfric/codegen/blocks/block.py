"""Discrete-time block, from which C functions on structs are generated.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types may be used in one program. The C allocates nothing and its only data are the constant
defaults, so one block serves any number of joints.

In memory, a struct equals the flat column of the block's variables. Neighbouring numbers of
identical elements, such as the states F_1 ... F_10, form one array member, `float F[10]`.
"""

import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from re import ASCII, fullmatch
from typing import NamedTuple, Protocol, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.emitter.c99 import FUNCTIONS, Real, block_comment
from symfric.emitter.emit import Code
from symfric.emitter.rolling import Array, Arrays
from symfric.foundation import checks
from symfric.foundation.graph import graph
from symfric.foundation.variable import stacked, strays, symbols_of
from symfric.model import Output, Variables

GROUPS = ("state", "param", "in", "out")
"""Names of the structs, and of the pointers to them."""

TEMPLATES = Path(__file__).parents[1] / "templates"
"""Folder of the fixed text of generated files."""

KEYWORDS = frozenset(Path(__file__).with_name("keywords.txt").read_text(encoding="utf-8").split())
"""Keywords of C99 and C++."""

SHEET = tomllib.loads(Path(__file__).with_name("sheet.toml").read_text(encoding="utf-8"))
"""Fixed texts of data sheets."""

RESERVED = frozenset(
    {*KEYWORDS, *GROUPS, "status", *FUNCTIONS.values(), *(f"{f}f" for f in FUNCTIONS.values())}
)
"""Names that variables must not have."""


class ElementArray(NamedTuple):
    """Neighbouring variables of a group that form an array in C, one for each identical element.

    Attributes:
        group: one of `GROUPS`.
        name: C identifier of the array.
        first: row of the first variable in its group.
        size: number of variables.
    """

    group: str
    name: str
    first: int
    size: int


class Member(NamedTuple):
    """Member of a struct.

    Attributes:
        name: C identifier.
        unit: unit of each number.
        doc: description, may be "".
        first: row of its first number in the flat struct.
        size: 0 for a single number, else the length of the array.
    """

    name: str
    unit: str
    doc: str
    first: int
    size: int = 0

    @property
    def declared(self) -> str:
        """Declaration, such as `F[10]`."""
        return f"{self.name}[{self.size}]" if self.size else self.name

    @property
    def length(self) -> int:
        """Number of values of the member."""
        return max(self.size, 1)

    @property
    def places(self) -> tuple[str, ...]:
        """C expressions of the numbers of the member: `F[0]`, `F[1]`, ..."""
        if not self.size:
            return (self.name,)
        return tuple(f"{self.name}[{i}]" for i in range(self.size))


@final
@dataclass(frozen=True, eq=False)
class Block:
    """Discrete-time block; each group of variables may be empty.

        x+ = next(x, u, p),   y = outputs(x, u, p)

    Attributes:
        name: C identifier, prefix of its types and functions.
        doc: description, one line or a few.
        states, inputs, parameters: named variables; `start` is the value after initialisation and
            the default of a parameter.
        next: SX (n, 1), the states after the step.
        outputs: named results.
        resets: further initialisations, by name: states as functions of inputs and parameters, SX
            (n, 1), and the purpose.
        constants: numbers folded into the expressions, by name, for the header.
        about: meaning and unit of constants, by name.
        equations: formulas that the block solves, line by line, as in a paper.
        discretisation: method of a step, in words and formulas, line by line.
        use: sentences of advice on inputs and results.
        limits: sentences about restrictions.
        sources: publications of the formulas.
        arrays: variables that are arrays in C, see `symfric.codegen.blocks.variables`.

    Raises:
        ValueError: all problems at once: repeated or invalid names, start values that are not
            numbers, wrong numbers of rows, undeclared symbols.
    """

    name: str
    doc: str = ""
    states: Variables = ()
    inputs: Variables = ()
    parameters: Variables = ()
    next: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    outputs: Mapping[str, Output] = field(default_factory=dict[str, Output])
    resets: Mapping[str, tuple[ca.SX, str]] = field(default_factory=dict[str, tuple[ca.SX, str]])
    constants: Mapping[str, float] = field(default_factory=dict[str, float])
    about: Mapping[str, str] = field(default_factory=dict[str, str])
    equations: str = ""
    discretisation: str = ""
    use: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    arrays: tuple[ElementArray, ...] = ()

    def __post_init__(self) -> None:
        problems = "; ".join(self._problems())
        if problems:
            raise ValueError(f"block '{self.name}': {problems}")
        for variable in (*self.states, *self.parameters):
            checks.number(f"block '{self.name}': {variable.name}", variable.start)

    def _problems(self) -> Iterator[str]:
        names = [v.name for v in self.variables] + [*self.outputs]
        for name in (self.name, *names, *self.resets):
            if not fullmatch(r"[A-Za-z]\w*", name, ASCII) or name in RESERVED:
                yield f"expected a free C identifier, got {name!r}"
        for name, count in Counter(names).items():
            if count > 1:
                yield f"expected every name once, got '{name}' twice"
        expected = len(self.states)
        for what, rows in {"next": self.next, **self._reset_states}.items():
            count = ca.SX(rows).numel()
            if count != expected:
                yield f"{what}: expected {expected} rows (one a state), got {count}"
        if not (expected or self.outputs):
            yield "expected states or outputs, got none"
        stray = strays(self.everything, symbols_of(self.variables))
        if stray:
            yield f"expected only declared symbols, got {', '.join(stray)}"

    @property
    def groups(self) -> dict[str, Variables]:
        """Variables of the structs state, param and in, by struct."""
        return dict(zip(GROUPS, (self.states, self.parameters, self.inputs), strict=False))

    @property
    def variables(self) -> Variables:
        """States, inputs and parameters."""
        return (*self.states, *self.inputs, *self.parameters)

    @cached_property
    def everything(self) -> ca.SX:
        """All expressions in one column."""
        return ca.veccat(self.next, self._out, *self._reset_states.values())

    @property
    def _out(self) -> ca.SX:
        return stacked(output.expression for output in self.outputs.values())

    @property
    def _reset_states(self) -> dict[str, ca.SX]:
        return {name: states for name, (states, _) in self.resets.items()}

    @cached_property
    def step(self) -> ca.Function:
        """Function (state, param, in) -> (state_next, out); all are columns."""
        return self._function("step", {"state_next": self.next, "out": self._out})

    @property
    def sample_time(self) -> float | None:
        """Step size h [s], a constant or the default of a parameter; None without a step size."""
        starts = {v.name: float(v.start) for v in self.parameters}
        return starts.get("h", self.constants.get("h"))

    @property
    def is_function(self) -> bool:
        """True if the block is a C function of scalars: it has no states and one output."""
        return not self.states and len(self.outputs) == 1

    @cached_property
    def fingerprint(self) -> str:
        """Sixteen hexadecimal digits that identify names, units, numbers, operations and ranges."""
        content = (
            self.name,
            [
                [(v.name, v.unit, float(v.start).hex(), v.nominal, v.lower, v.upper) for v in group]
                for group in self.groups.values()
            ],
            [(name, output.unit) for name, output in self.outputs.items()],
            graph(self.step),
            [(name, graph(self.reset(name))) for name in self.resets],
        )
        return sha256(repr(content).encode()).hexdigest()[:16]

    @cached_property
    def members(self) -> dict[str, tuple[Member, ...]]:
        """Members of each struct, without empty structs."""
        flat = {g: [(v.name, v.unit, v.doc) for v in of] for g, of in self.groups.items()}
        flat["out"] = [(name, output.unit, output.doc) for name, output in self.outputs.items()]
        kept = GROUPS[:2] if self.is_function else GROUPS
        return {group: tuple(self._members(group, flat[group])) for group in kept if flat[group]}

    def _members(self, group: str, rows: Sequence[tuple[str, str, str]]) -> Iterator[Member]:
        arrays = {a.first: a for a in self.arrays if a.group == group}
        row = 0
        while row < len(rows):
            (name, unit, doc), size = rows[row], 0
            if row in arrays:
                name, size = arrays[row].name, arrays[row].size
                same = all(other[2] == doc for other in rows[row : row + size])
                doc = f"{doc}, of each element".removeprefix(", ") if same else "of each element"
            yield Member(name, unit, doc, row, size)
            row += max(size, 1)

    def places(self, group: str) -> tuple[str, ...]:
        """Return the C expressions that follow `state->` or the like, in the order of the block."""
        return tuple(p for member in self.members.get(group, ()) for p in member.places)

    def indexed(self, results: Sequence[str], guards: bool) -> Arrays:
        """Return the arrays that loops may index, for the structs in the order of `GROUPS`.

        Args:
            results: structs to which the function writes its results.
            guards: True if guards repair each input in a local variable, so that loops must not
                read the arrays of inputs.
        """

        def of(groups: Sequence[str]) -> tuple[Array, ...]:
            return tuple(
                Array(number, member.first, member.size, f"{group}->{member.name}")
                for number, group in enumerate(groups)
                for member in self.members.get(group, ())
                if member.size and not (guards and group == "in")
            )

        return Arrays(of(GROUPS[:3]), of(results))

    def reset(self, name: str) -> ca.Function:
        """Return the initialisation (state, param, in) -> (state_next), which ignores state."""
        return self._function(name, {"state_next": self.resets[name][0]})

    @property
    def functions(self) -> list[ca.Function]:
        """Step and further initialisations; their results are the columns of a run."""
        return [self.step, *map(self.reset, self.resets)]

    def _function(self, name: str, results: Mapping[str, ca.SX]) -> ca.Function:
        columns = [symbols_of(group) for group in self.groups.values()]
        dense = [ca.densify(ca.SX(result)) for result in results.values()]
        return ca.Function(name, columns, dense, list(GROUPS[:3]), list(results))


class Statements(Protocol):
    """Author of the statements of a step, in place of `emit`."""

    def code(self, targets: Sequence[Sequence[str]], loads: Mapping[tuple[int, int], str]) -> Code:
        """Return the statements of a step, for the arguments of `emit`."""
        ...

    def helpers(self, text: str) -> str:
        """Return the functions that the C `text` calls."""
        ...


@final
@dataclass(frozen=True, eq=False)
class CBlock:
    """Block as C in one type of numbers.

    Attributes:
        guards: True if the C checks its numbers, see `symfric.codegen.guards`.
        author: author of the statements; None for those of `emit`.
    """

    block: Block
    real: Real
    guards: bool = True
    author: Statements | None = None

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
