"""Names and structs of a block in one floating point type.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types live in one program. Nothing is allocated and no data but the constant defaults exist,
so one block serves any number of joints.
"""

from symfric.codegen.blocks.block import Block
from symfric.emitter.c99 import Real


def prefix(block: Block, real: Real) -> str:
    """What all names of a block in one type begin with; also the name of its files."""
    return f"{block.name}_{real.suffix}"


def members(block: Block) -> dict[str, list[tuple[str, str, str]]]:
    """Struct -> (name, unit, text) of its members; empty structs are left out."""
    variables = {"state": block.states, "param": block.parameters, "in": block.inputs}
    found = {group: [(v.name, v.unit, v.doc) for v in of] for group, of in variables.items()}
    found["out"] = [(name, output.unit, output.doc) for name, output in block.outputs.items()]
    if block.is_function:
        del found["in"], found["out"]
    return {group: rows for group, rows in found.items() if rows}
