"""The C functions of a block."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.writing.layout import members, places, prefix
from symfric.codegen.writing.text import WIDTH
from symfric.emitter.c99 import Real
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph


@dataclass(frozen=True)
class Routine:
    """One C function.

    Attributes:
        result: type of what it returns.
        calls: function of math.h (double's name) -> number of calls.
        operations: number of operations, calls included.
    """

    name: str
    result: str
    arguments: tuple[str, ...]
    doc: str
    statements: tuple[str, ...]
    calls: Counter[str]
    operations: int

    @property
    def head(self) -> str:
        """The prototype without its semicolon."""
        start = f"{self.result} {self.name}("
        one_line = f"{start}{', '.join(self.arguments)})"
        return (
            one_line if len(one_line) <= WIDTH else one_line.replace(", ", ",\n" + " " * len(start))
        )


def routines(block: Block, real: Real) -> tuple[Routine, ...]:
    """The C functions of a block: `_init`, its resets and `_step`, or one function of scalars.

    Raises:
        ValueError: an operation without counterpart in C99, or a constant outside the type.
    """
    name = prefix(block, real)
    if block.is_function:
        (output,) = block.outputs.values()
        (shown,) = block.outputs
        doc = f"{shown} [{output.unit}]: {output.doc}".rstrip(": ") + "."
        return (_routine(block, real, name, doc, block.step, [[], ["return {};"]]),)
    store = [f"state->{place} = {{}};" for place in places(block, "state")]
    show = [f"out->{place} = {{}};" for place in places(block, "out")]
    found = [
        _routine(block, real, f"{name}_{reset}", doc, block.reset(reset), [store])
        for reset, (_, doc) in block.resets.items()
    ]
    if block.states:
        found.insert(0, _init(block, real))
    doc = "One step: outputs and next state." if block.states else "All outputs."
    found.append(_routine(block, real, f"{name}_step", doc, block.step, [store, show]))
    return tuple(found)


def _init(block: Block, real: Real) -> Routine:
    name = prefix(block, real)
    values = tuple(
        f"state->{place} = {real.literal(float(v.start))};"
        for place, v in zip(places(block, "state"), block.states, strict=True)
    )
    doc = "Initial state; call it before the first step."
    return Routine(f"{name}_init", "void", (f"{name}_state_t *state",), doc, values, Counter(), 0)


def _routine(
    block: Block,
    real: Real,
    name: str,
    doc: str,
    function: ca.Function,
    targets: Sequence[Sequence[str]],
) -> Routine:
    groups = (block.states, block.parameters, block.inputs)
    source = graph(function)
    code = emit(source, [[v.name for v in group] for group in groups], targets, real)
    scalars = block.is_function
    used = sorted(node.entry for node in source.nodes if node.op == ca.OP_INPUT)
    loads = [
        f"const {real.name} {groups[i][j].name} = {GROUPS[i]}->{places(block, GROUPS[i])[j]};"
        for i, j in used
        if not (scalars and GROUPS[i] == "in")
    ]
    present = members(block)
    arguments = [
        f"{'const ' if group in ('param', 'in') else ''}{prefix(block, real)}_{group}_t *{group}"
        for group in GROUPS
        if group in present and (group != "out" or len(targets) > 1)
    ]
    idle = [g for i, g in enumerate(GROUPS[:3]) if g in present and i not in {u[0] for u in used}]
    if scalars:
        arguments = [f"{real.name} {v.name}" for v in block.inputs] + arguments
        idle += [v.name for j, v in enumerate(block.inputs) if (2, j) not in used]
    voids = [f"(void){what};" for what in idle if what != "state"]
    result = real.name if scalars else "void"
    statements = (*voids, *loads, *code.lines)
    return Routine(name, result, tuple(arguments), doc, statements, code.calls, code.operations)
