"""Block of a model or a scene: a plant that advances by fixed steps."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import SHEET, Block
from symfric.codegen.blocks.from_law import equations
from symfric.codegen.blocks.variables import (
    Fold,
    above_zero,
    as_constants,
    step_size,
    variable,
    without_idle,
)
from symfric.foundation import checks
from symfric.foundation.parameters import Parameter, Parametric, Variable, parameters
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.attempt import build_fixed
from symfric.integrator.methods.families import BackwardEuler, Exponential, Rosenbrock
from symfric.integrator.methods.method import Method, suited_to_start
from symfric.integrator.methods.tableaux import METHODS, Radau
from symfric.model import Model, Output, Variables, check_model


class ModelSource(Protocol):
    """Protocol of scenes: objects whose `model` accepts free parameters."""

    def model(self, free: Iterable[str] = ()) -> Model:
        """Return the model with the parameters in `free` as symbols."""
        ...


def plant_block(
    model: Model | ModelSource,
    *,
    h: float | None = None,
    method: str = "auto",
    name: str | None = None,
    free: Sequence[str] | None = None,
    fold: Fold = None,
) -> Block:
    """Return the discrete-time block of a model or a scene, with the names of the model.

    A step integrates over h with the inputs held; the outputs are those at the end of the step.
    Algebraic variables, and time if the equations depend on it, are also states of the block. The
    initial states are the start values of the model, with algebraic variables consistent with the
    start values of the inputs; changing parameters at run time does not change them.

    Fixed steps have no error control and do not detect friction that jams. The table shows, for
    Rabinowicz's stick-slip over 20 s, the largest error relative to the largest position at steps
    of 1 ms and 0.1 ms, and the number of operations of a step:

        method            order   BrownMcPhee         LuGre
        "rodas3"          3       5e-7   5e-9   125   4e-6   9e-9    189
        "rodas4p"         4       2e-6   5e-11  265   1e-7   2e-10   397
        "radau5"          5       7e-7   7e-11  460   4e-8   6e-10   697
        "backward_euler"  1       1e-2   1e-3   176   1e-2   1e-3    273
        "exponential"     1       8e-3   8e-4    68   1e-2   1e-3    105

    In double, the C computes the same bits as CasADi. In float, a step of this scene differs by up
    to 3e-5 of the peak of a signal (2e-4 with Rodas5P), which is more than `verify` allows, because
    the sliding velocity is a difference of larger velocities. Use double if the time of break-away
    matters.

    If h does not resolve the transition (10 ms here, or 1 ms with v_t = 1e-5 m/s), no method is
    accurate; backward Euler stays bounded, the others may diverge. With friction on light links, h
    rarely resolves it: a falling six-joint arm diverges at 1 ms with all other methods. Therefore
    backward Euler is the default for mechanisms with friction. Compare with `simulate`. The
    exponential method is explicit in the coupling of the equations, and for ODEs only.

    All parameters of a scene and of its law can be changed at run time, except those whose value
    selects a cheaper form of the law (`runtime_parameters`). The table shows the operations of a
    step with all parameters constant, with the default, and with all of them variable (for the
    first two scenes also the instructions on a Cortex-M4F in float, from
    `symfric.embedded.measure`):

        drive, BrownMcPhee            118    126    143     554   548   574
        rabinowicz, LuGre             201    217    243     576   609   912
        four_mass, LuGre             3222   3341   3458
        arm, LuGre                  32133  32314  32485

    Args:
        model: a model, whose parameters `model.p` remain variable at run time, or a scene; without
            events.
        h: step size [s] as a constant; without it h is a parameter, by default 1 ms.
        method: one of `METHODS`, see `simulate` and `flow`; "auto" is backward_euler for mechanisms
            with friction, else rodas3.
        name: C identifier; default the name of the model.
        free, fold: the only parameters of a scene that remain variable, or those that become
            constants, as in `law_block`.

    Raises:
        ValueError: an unknown method, or a method for ODEs with a DAE; events; a step size <= 0;
            start values without consistent algebraic variables; outputs that depend on time
            although the equations do not.
    """
    folded: list[Parameter] = []
    machine = model
    if not isinstance(model, Model):
        model, folded = _opened(model, free, fold)
    elif free is not None or fold is not None:
        raise ValueError(
            "codegen: free, fold: expected with a scene only, got a model; "
            "its parameters are model.p"
        )
    check_model("codegen", model)
    where = f"codegen '{model.name}'"
    if name is not None:
        checks.identifier(f"{where}: name", name)
    method = fixed_method(where, model, method)
    if model.events:
        raise ValueError(
            f"{where}: expected a model without events, got {len(model.events)}; "
            "remove your own events, and use a smooth or bristle law"
        )
    size, formula = step_size(where, h), METHODS[method]
    u = model.vector("u")
    held = InputData(u, u, np.zeros(2), np.zeros((len(model.u), 1)), ("plant",))
    whole = suited_to_start(system(model, held), formula, model)
    following = build_fixed(whole, formula)(whole.y, ca.SX(size.h), whole.d)
    block = Block(
        name or model.name,
        doc=f"Plant '{model.name}': the machine with its friction, for simulation in real time.",
        states=_states(model, whole, where),
        inputs=model.u,
        parameters=model.p + size.parameters,
        next=following,
        outputs=_outputs(model, whole, following, where),
        equations=equations(machine) if isinstance(machine, Parametric) else "",
        discretisation=of_method(formula, whole.n > whole.nx),
        use=tuple(SHEET["plant"]["use"]),
        limits=tuple(SHEET["plant"]["limits"]),
        sources=(formula.source,),
        **as_constants(folded, size.constants),
    )
    if isinstance(machine, Model):
        return block
    widths = [n for n, p in parameters(machine).items() if p.role == "width"]  # pyright: ignore[reportArgumentType]
    return above_zero(without_idle(block, free, where), widths)


def fixed_method(where: str, model: Model, method: str) -> str:
    """Return the method of fixed steps; "auto" selects one for the model, see `plant_block`."""
    checks.choice(f"{where}: method", method, ["auto", *METHODS])
    if method != "auto":
        return method
    return "backward_euler" if model.holonomic and model.monitors else "rodas3"


def _opened(
    machine: ModelSource, free: Sequence[str] | None, fold: Fold
) -> tuple[Model, list[Parameter]]:
    """Return the model of a scene with variable parameters, and the constant parameters."""
    if not (isinstance(machine, Parametric) and hasattr(machine, "model")):
        raise checks.refused("codegen", "a model, or a scene such as Rabinowicz(LuGre())", machine)
    names, problems = variable(machine, free, fold)
    if problems:
        raise ValueError(f"codegen '{type(machine).__name__}': {'; '.join(problems)}")
    return machine.model(names), [p for n, p in parameters(machine).items() if n not in names]


def _states(model: Model, whole: System, where: str) -> Variables:
    """Return all unknowns as states, with consistent start values."""
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
    """Return the outputs at the end of the step."""
    late = [n for n, o in model.outputs.items() if ca.depends_on(ca.SX(o.expression), model.t)]
    if late and not whole.timed:
        raise ValueError(
            f"{where}: expected outputs without time, since the equations do not depend on it, got "
            f"{', '.join(late)}; make time a state with rate 1"
        )

    return {
        name: replace(o, expression=ca.substitute(ca.SX(o.expression), whole.y, following))
        for name, o in model.outputs.items()
    }


def of_method(method: Method, algebraic: bool) -> str:
    """Return the text about the fixed step of a method for x' = f(x, u), 0 = g(x, z, u).

    Args:
        algebraic: True if there are algebraic unknowns z.
    """
    texts = SHEET["step"]
    return (
        f"Fixed steps by {method.name}, order {method.order}. {texts['held']}\n"
        f"{_formula(method)}{texts['algebraic'] * algebraic}\n{texts['outputs']}"
    )


def _formula(method: Method) -> str:
    """Return the formula of one step."""
    match method:
        case BackwardEuler():
            return f"    x+ = x + h f(x+, u)    by {method.iterations} Newton iterations from x"
        case Radau():
            return (
                f"    X_i = x + h sum a_ij f(X_j, u),   i, j = 1 ... {len(method.A)},   "
                f"x+ = X_{len(method.A)}\n"
                f"    by {method.iterations} simplified Newton iterations"
            )
        case Rosenbrock():
            return (
                "    [I / (gamma h) - df/dx] k_i = f(x + sum a_ij k_j, u) + sum c_ij k_j / h\n"
                f"    x+ = x + sum m_i k_i,   i = 1 ... {len(method.A)}, gamma = {method.gamma:.6g}"
            )
        case Exponential():
            return "    x_i+ = x_i + h phi1(h df_i/dx_i) f_i(x, u),   phi1(a) = (exp(a) - 1) / a"
        case _:
            return (
                "    X_i = x + h sum a_ij f(X_j, u),   x+ = x + h sum b_i f(X_i, u)    (explicit)"
            )
