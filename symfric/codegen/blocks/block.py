"""Discrete-time block, the source of C functions on structs."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from re import fullmatch
from typing import final

import casadi as ca

from symfric.emitter.c99 import FUNCTIONS
from symfric.foundation import checks
from symfric.foundation.graph import graph
from symfric.foundation.variable import strays, symbols_of
from symfric.model import Output, Variables

GROUPS = ("state", "param", "in", "out")
"""Names of the structs, and of the pointers to them."""

KEYWORDS = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl const
    const_cast constexpr continue decltype default delete do double dynamic_cast else enum explicit
    export extern false float for friend goto if inline int long mutable namespace new noexcept
    not not_eq nullptr operator or or_eq private protected public register reinterpret_cast
    restrict return short signed sizeof static static_assert static_cast struct switch template
    this thread_local throw true try typedef typeid typename union unsigned using virtual void
    volatile wchar_t while xor xor_eq
    """.split()  # noqa: SIM905
)
"""Keywords of C99 and C++."""

RESERVED = frozenset(
    {*KEYWORDS, *GROUPS, "status", *FUNCTIONS.values(), *(f"{f}f" for f in FUNCTIONS.values())}
)
"""Names that variables must not have."""


@final
@dataclass(frozen=True)
class Elements:
    """Neighbouring variables of a group that C holds in one array, one per identical element.

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


@final
@dataclass(frozen=True, eq=False)
class Block:
    """Discrete-time block, all of whose groups may be empty.

        x+ = next(x, u, p),   y = outputs(x, u, p)

    Attributes:
        name: C identifier, prefix of its types and functions.
        doc: description, one line or a few.
        states, inputs, parameters: named variables; `start` is the value after initialisation and
            the default of a parameter.
        next: SX (n, 1), the states after the step.
        outputs: named results.
        resets: further initialisations by name: the states, SX (n, 1), as functions of inputs and
            parameters, and their purpose.
        constants: numbers folded into the expressions, by name, for the header.
        about: meaning of constants, with their units, by name.
        equations: formulas that the block solves, line by line, as in a paper.
        discretisation: method of a step, in words and formulas, line by line.
        use: advice on inputs and results, a sentence each.
        limits: restrictions, a sentence each.
        sources: of the formulas, one each.
        arrays: variables that are arrays in C, see `symfric.codegen.blocks.variables`.

    Raises:
        ValueError: all problems at once: names that are repeated or invalid, start values that are
            not numbers, row counts, undeclared symbols.
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
    arrays: tuple[Elements, ...] = ()

    def __post_init__(self) -> None:
        problems = [*self._name_problems(), *self._shape_problems()]
        if problems:
            raise ValueError(f"block '{self.name}': " + "; ".join(problems))
        for variable in (*self.states, *self.parameters):
            checks.number(f"block '{self.name}': {variable.name}", variable.start)

    def _name_problems(self) -> list[str]:
        variables = [v.name for v in (*self.states, *self.inputs, *self.parameters)]
        members = variables + list(self.outputs)
        wrong = [
            name
            for name in (self.name, *members, *self.resets)
            if not (name.isascii() and fullmatch(r"[A-Za-z]\w*", name)) or name in RESERVED
        ]
        repeated = [name for name, count in Counter(members).items() if count > 1]
        return [
            *(f"expected a free C identifier, got {name!r}" for name in wrong),
            *(f"expected every name once, got '{name}' twice" for name in repeated),
        ]

    def _shape_problems(self) -> list[str]:
        expected, problems = len(self.states), list[str]()
        for what, rows in {"next": self.next, **self._reset_states}.items():
            if ca.SX(rows).numel() != expected:
                problems.append(
                    f"{what}: expected {expected} rows (one a state), got {ca.SX(rows).numel()}"
                )
        if not (expected or self.outputs):
            problems.append("expected states or outputs, got none")
        declared = symbols_of((*self.states, *self.inputs, *self.parameters))
        stray = strays(self.everything, declared)
        if stray:
            problems.append(f"expected only declared symbols, got {', '.join(stray)}")
        return problems

    @cached_property
    def everything(self) -> ca.SX:
        """All expressions in one column."""
        outputs = (output.expression for output in self.outputs.values())
        return ca.veccat(ca.SX(0, 1), self.next, *outputs, *self._reset_states.values())

    @property
    def _reset_states(self) -> dict[str, ca.SX]:
        return {name: states for name, (states, _) in self.resets.items()}

    @cached_property
    def step(self) -> ca.Function:
        """(state, param, in) -> (state_next, out), all columns."""
        results = ca.SX(0, 1), *(ca.SX(output.expression) for output in self.outputs.values())
        return self._function("step", {"state_next": self.next, "out": ca.vertcat(*results)})

    @property
    def sample_time(self) -> float | None:
        """Step size h [s], a constant or the default of a parameter; None if it has none."""
        starts = {v.name: float(v.start) for v in self.parameters}
        return starts.get("h", self.constants.get("h"))

    @property
    def is_function(self) -> bool:
        """True if it is one C function of scalars: no states and a single output."""
        return not self.states and len(self.outputs) == 1

    @cached_property
    def fingerprint(self) -> str:
        """Sixteen hexadecimal digits that change with names, units, numbers, operations, ranges."""
        groups = (self.states, self.parameters, self.inputs)
        content = (
            self.name,
            [
                [(v.name, v.unit, float(v.start).hex(), v.nominal, v.lower, v.upper) for v in group]
                for group in groups
            ],
            [(name, output.unit) for name, output in self.outputs.items()],
            graph(self.step),
            [(name, graph(self.reset(name))) for name in self.resets],
        )
        return sha256(repr(content).encode()).hexdigest()[:16]

    def reset(self, name: str) -> ca.Function:
        """Return (state, param, in) -> (state_next), the initialisation `name`; the state is
        not used.
        """
        return self._function(name, {"state_next": self.resets[name][0]})

    def _function(self, name: str, results: Mapping[str, ca.SX]) -> ca.Function:
        groups = (self.states, self.parameters, self.inputs)
        columns = [symbols_of(group) for group in groups]
        dense = [ca.densify(ca.SX(result)) for result in results.values()]
        return ca.Function(name, columns, dense, list(GROUPS[:3]), list(results))
