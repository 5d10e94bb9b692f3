"""Friction in the joints of a mechanism as parts of a block: every joint has its own numbers."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_law import law_block
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import symbols_of
from symfric.model import Variables
from symfric.multibody.friction import Contact, JointFriction


@final
@dataclass(frozen=True, eq=False)
class Rubbing:
    """Friction of one contact over a step.

    Attributes:
        along: the coordinate that it resists.
        law: the block of its law alone, whose texts are those of the data sheet.
        force: friction [N], for a law of the moment [N m].
        parameters, states: under the names that the law gives them.
        following: the states after the step.
        sliding: the states of long sliding.
    """

    along: str
    law: Block
    force: ca.SX
    parameters: Variables
    states: Variables
    following: ca.SX
    sliding: ca.SX


def rubbing(contact: Contact, along: str, normal: ca.SX, h: ca.SX, *, fold: bool) -> Rubbing:
    """The friction of a contact under the normal force `normal` [N], in a step of `h` [s].

    A constant normal force is a parameter N.

    Args:
        along: the coordinate that it resists.
        fold: whether all parameters are constants.

    Raises:
        ValueError: as `law_block`; a law that asks for more than v and N.
    """
    law, friction = contact.friction.law, contact.friction
    if law.inputs:
        raise ValueError(
            f"inverse dynamics: joint '{contact.joint}' > friction > law: expected one that needs "
            f"v and N alone, got {type(law).__name__}, which asks for "
            f"{', '.join(i.name for i in law.inputs)}"
        )
    block = law_block(law, free=() if fold else None, turning=friction.turning)
    v, N = block.inputs
    level = () if fold or not ca.depends_on(block.everything, N.symbol) else _level(friction)
    if level:
        normal = level[0].symbol
    sizes = [variable for variable in block.parameters if variable.name == "h"]
    force, following, sliding = ca.substitute(
        [
            ca.SX(block.outputs["F"].expression),
            ca.SX(block.next),
            ca.SX(block.resets["init_sliding"][0]) if block.states else ca.SX(0, 1),
        ],
        [v.symbol, N.symbol, symbols_of(sizes)],
        [contact.slip, normal, h if sizes else ca.SX(0, 1)],
    )
    parameters = tuple(v for v in block.parameters if v.name != "h")
    return Rubbing(
        along=along,
        law=block,
        force=force,
        parameters=(*parameters, *level),
        states=block.states,
        following=following,
        sliding=sliding,
    )


def _level(friction: JointFriction) -> Variables:
    """The constant normal force of a joint as a parameter, where it has one."""
    if friction.normal is None or not is_number(friction.normal):
        return ()
    start, turning = float(friction.normal), friction.turning
    doc, unit = ("friction level", "N m") if turning else ("normal force", "N")
    known = max(start, 1e-3)
    return (Variable("N", unit, start=start, lower=0.0, upper=1e6, nominal=known, doc=doc),)
