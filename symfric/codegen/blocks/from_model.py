"""A model as a block: a plant that advances by fixed steps."""

from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_law import step_variable
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.suited import suited_to_start
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.step.attempt import build_fixed
from symfric.model import Model, Output, Variables, check_model


def plant_block(
    model: Model, *, h: float | None = None, method: str = "auto", name: str | None = None
) -> Block:
    """The discrete-time block of a model: states, inputs and outputs by their names.

    A step integrates over h with the inputs held; the outputs are those at its end. Algebraic
    variables, and time where the equations depend on it, are states of the block, too. Initial
    states are the model's start values, the algebraic ones consistent with the start values of the
    inputs; they do not follow parameters that are changed at run time.

    Fixed steps have no error control and do not see friction that jams. Rabinowicz's stick-slip
    over 20 s, largest error relative to the largest position, at a step of 1 ms and 0.1 ms, and
    operations of a step:

        method            order   BrownMcPhee         LuGre
        "rodas3"          3       5e-7   5e-9   125   4e-6   9e-9    189
        "rodas4p"         4       2e-6   5e-11  265   1e-7   2e-10   397
        "radau5"          5       7e-7   7e-11  460   4e-8   6e-10   697
        "backward_euler"  1       1e-2   1e-3   176   1e-2   1e-3    273
        "exponential"     1       8e-3   8e-4    68   1e-2   1e-3    105

    In double the C is CasADi's to the bit. In float one step of this scene differs by up to 3e-5 of
    a signal's peak (2e-4 by Rodas5P), more than `verify` allows: the sliding velocity is a
    difference of larger ones. Use double where a contact must break away in time.

    Where h does not resolve the transition (10 ms here, or 1 ms with v_t = 1e-5 m/s) none of them
    is accurate; backward Euler stays bounded, the others may grow without bound. Light links with
    friction rarely let h resolve it: a six-joint arm that falls runs away at 1 ms by all others,
    which is why mechanisms with friction use it unless told otherwise. Compare with `simulate`.
    The exponential method is explicit in what couples the equations, and for ODEs only.

    Args:
        model: without events; the parameters in `model.p` stay variable at run time.
        h: step size [s] as a constant; without it h is a parameter, by default 1 ms.
        method: one of `METHODS`, see `simulate` and `flow`; "auto" is backward_euler for mechanisms
            with friction, else rodas3.
        name: C identifier; default the name of the model.

    Raises:
        ValueError: unknown method, or one for ODEs only with a DAE; events; a step size <= 0; start
            values without consistent algebraic ones; outputs that depend on time where the
            equations do not.
    """
    check_model("codegen", model)
    where = f"codegen '{model.name}'"
    if name is not None:
        checks.text(f"{where}: name", name, "a C identifier")
    checks.choice(f"{where}: method", method, ["auto", *METHODS])
    if method == "auto":
        method = "backward_euler" if model.holonomic and model.monitors else "rodas3"
    if model.events:
        raise ValueError(
            f"{where}: expected a model without events, got {len(model.events)}; "
            "use a smooth or bristle law"
        )
    size = step_variable(where, h)
    whole = suited_to_start(_held(model), METHODS[method], model)
    duration = size.symbol if h is None else ca.SX(float(h))
    following = build_fixed(whole, METHODS[method])(whole.y, duration, whole.d)
    return Block(
        name or model.name,
        doc=_described(model, method),
        states=_states(model, whole, where),
        inputs=model.u,
        parameters=model.p + ((size,) if h is None else ()),
        next=following,
        outputs=_outputs(model, whole, following, where),
        constants={} if h is None else {"h": float(h)},
    )


def _held(model: Model) -> System:
    """The equations with the inputs as run data."""
    u = model.vector("u")
    return system(model, InputData(u, u, np.zeros(2), np.zeros((len(model.u), 1)), ("plant",)))


def _states(model: Model, whole: System, where: str) -> Variables:
    """All unknowns with consistent start values."""
    known = {v.name: v for v in (*model.x, *model.z)}
    rates = {f"{v.name}_dot": Variable(f"{v.name}_dot", f"({v.unit})/s") for v in model.x}
    time = {"t": Variable("t", "s", doc="time")}
    unknowns = [(rates | time | known)[name] for name in whole.names]
    start: NDArray[np.float64] = np.zeros(whole.n)
    start[: whole.nx] = model.initial_state()
    for i in range(whole.nx, whole.n):
        start[i] = checks.number(f"{where}: {unknowns[i].name}", unknowns[i].start)
    start = consistent(whole, where, start, np.concatenate([model.values("p"), model.values("u")]))
    return tuple(
        replace(v, start=float(value), symbol=symbol)
        for v, value, symbol in zip(unknowns, start, ca.vertsplit(whole.y), strict=True)
    )


def _outputs(model: Model, whole: System, following: ca.SX, where: str) -> dict[str, Output]:
    """The outputs at the end of the step."""
    late = [n for n, o in model.outputs.items() if ca.depends_on(ca.SX(o.expression), model.t)]
    if late and not whole.timed:
        raise ValueError(
            f"{where}: expected outputs without time where the equations do not depend on it, got "
            f"{', '.join(late)}; make time a state with rate 1"
        )

    def at_end(output: Output) -> Output:
        expression = ca.substitute(ca.SX(output.expression), whole.y, following)
        return replace(output, expression=expression)

    return {name: at_end(output) for name, output in model.outputs.items()}


def _described(model: Model, method: str) -> str:
    used = METHODS[method]
    return (
        f"Plant '{model.name}' in fixed steps of the {used.name} method (order {used.order}), "
        f"inputs held\nover the step, outputs at its end.\n\nSource of the method: {used.source}."
    )
