"""One contact of a population as a block; the population is a loop over an array of them."""

import casadi as ca

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_law import SIGN, STEP_SIZE, step_variable
from symfric.codegen.blocks.law_text import equations, texts
from symfric.foundation import checks
from symfric.foundation.parameters import Variable, parameters
from symfric.laws import Population, law_name
from symfric.model import Output

LOOP = (
    "The friction force of the population is the sum of F over an array of states, all with the "
    "same v and N, each with a random number r of its own, even in -1 to 1; {redrawn}."
)
STEP = "Keep |v| h below {step:g} m, over which a contact changes."


def contact_block(law: Population, *, name: str | None = None, h: float | None = None) -> Block:
    """The discrete-time block of one contact of `law` with inputs v, N, r and its force F.

    The step is that of `Population.advance`, so that a loop in C over what `Population.begin`
    returns follows NumPy to rounding. Keep |v| h below `Population.step`.

    Args:
        law: a population; its numbers are constants of the block.
        name: C identifier; default the name of the population.
        h: step size [s] as a constant; without it h is a parameter, by default 1 ms.

    Raises:
        ValueError: a step size <= 0.
    """
    where = f"codegen '{law_name(law)}'"
    if name is not None:
        checks.identifier(f"{where}: name", name)
    states = tuple(Variable(s.name, s.unit, nominal=s.nominal, doc=s.doc) for s in law.states)
    v = Variable("v", "m/s", nominal=law.step / STEP_SIZE, doc="sliding velocity")
    N = Variable("N", "N", nominal=10.0, lower=0.0, doc="normal force of all contacts")
    r = Variable("r", "1", nominal=0.5, lower=-1.0, upper=1.0, doc="random number of the contact")
    size = step_variable(where, h)
    duration = size.symbol if h is None else float(h)
    z = ca.vertcat(*(state.symbol for state in states))
    rows = ca.SX(law.contact(z, r.symbol, v.symbol * duration, duration, N.symbol))
    redrawn = "draw r anew at every step" if law.redraws else "r stays the same at all steps"
    known = parameters(law).values()
    constants = {p.name: float(p.value) for p in known}
    return Block(
        name or law_name(law),
        doc="\n".join(text.title for text in texts(law)) + "\nOne contact of a population.",
        about={p.name: f"{p.doc} [{p.unit}]" for p in known},
        equations=equations(law),
        discretisation="One step of the contact with v, N and r held.",
        use=(LOOP.format(redrawn=redrawn), SIGN, STEP.format(step=law.step)),
        limits=tuple(limit for text in texts(law) for limit in text.limits),
        sources=tuple(text.source for text in texts(law)),
        states=states,
        inputs=(v, N, r),
        parameters=(size,) if h is None else (),
        next=rows[: len(states)],
        outputs={"F": Output(rows[len(states)], "N", "friction force of this contact")},
        constants=constants | ({} if h is None else {"h": float(h)}),
    )
