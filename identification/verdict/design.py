"""Models for optimal experiment design, whose states include the Fisher information of a motion.

    S' = df/dx S + df/dp diag(p),           S(0) = dx0/dp diag(p)
    Y  = dg/dx S + dg/dp diag(p)
    I' = sum_y Y_y' Y_y / (sigma_y^2 h),    I(0) = 1/prior^2

S are the sensitivities of the states to relative changes of the parameters. Y are those of the
measured signals y = g(x, u, p), sampled every h with noise sigma_y. I is the Fisher information.
Under white noise, the smallest relative standard errors of any unbiased estimator are the square
roots of the diagonal of I^-1 (Cramer and Rao). The output `information`, log det I divided by the
number of parameters, can be maximised by an optimal control problem:
`Problem(Phase(informative(model, ...), T=2.0), -at_end(lambda s: s.information), bounds=...)`.
Source: Mehra, IEEE Trans. Autom. Control 19(6), 1974; Swevers et al., IEEE Trans. Robotics 13(5),
1997 (excitation of robots).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import starts_of
from symfric.model import Model, Output, check_model


class NamedSignals(Protocol):
    """Signals by name, such as those of a trajectory."""

    def __getitem__(self, name: str, /) -> Any:
        """Return all values of a signal over time."""
        ...


def informative(
    model: Model,
    free: Iterable[str],
    measured: Mapping[str, float],
    *,
    step: float,
    prior: float = 1.0,
    aim: float = 1e-2,
) -> Model:
    """Return `model` with sensitivities and information as states, and the output "information".

    Args:
        model: explicit model without algebraic variables and events, smooth enough for
            optimisation; its parameters `p` include the free ones, with prior estimates as starts.
        free: parameters to be identified, none of them zero.
        measured: signal (state or output) -> standard deviation of its noise in SI units.
        step: sample time of the measurement [s].
        prior: relative standard error of the prior estimates.
        aim: desired relative standard error; it scales the information so that an optimiser
            converges.

    Limits: noise is white and the start state is known. The information is evaluated at the start
    values of the parameters; a design for a wide range needs `scenarios` of the problem.

    Raises:
        ValueError: an unknown parameter or signal, a parameter that is zero, a noise that is not
            above zero, or an unsupported model.
    """
    check_model("informative", model)
    if model.ode is None or model.z or model.events:
        such = "an explicit model without algebraic variables and events"
        raise checks.refused("informative", such, model.name)
    names = checks.names("informative: free", free, [v.name for v in model.p])
    sigma = checks.named("informative: measured", measured, list(model.signals))
    levels = [checks.number(f"informative: measured: {n}", s, above=0.0) for n, s in sigma.items()]
    step = checks.number("informative: step", step, unit="s", above=0.0)
    known = 1 / checks.number("informative: prior", prior, above=0.0) ** 2
    most = 1 / checks.number("informative: aim", aim, above=0.0) ** 2
    p = [next(v for v in model.p if v.name == n) for n in names]
    zero = [v.name for v in p if checks.as_number(v.start) in (None, 0.0)]
    if zero:
        raise checks.refused("informative: free", "start values that are not zero", zero[0])
    symbols, x = ca.vertcat(*(v.symbol for v in p)), model.vector("x")
    scale = ca.diag(symbols)

    S = [[_sensitivity(state, v) for v in p] for state in model.x]
    sensitivity = ca.vertcat(*(ca.horzcat(*(v.symbol for v in row)) for row in S))
    start = ca.jacobian(starts_of(model.x), symbols) @ scale
    rate = ca.jacobian(model.ode, x) @ sensitivity + ca.jacobian(model.ode, symbols) @ scale
    y = ca.vertcat(*(model.expression(n) for n in sigma))
    Y = ca.jacobian(y, x) @ sensitivity + ca.jacobian(y, symbols) @ scale
    growth = Y.T @ ca.diag(1 / ca.DM(levels) ** 2) @ Y / step

    lower = [(i, j) for i in range(len(p)) for j in range(i + 1)]
    entries = [
        Variable(_name(names[i], names[j]), "1", start=known * (i == j), nominal=most,
                 doc="Fisher information")
        for i, j in lower
    ]  # fmt: skip
    information = ca.SX(len(p), len(p))
    for (i, j), entry in zip(lower, entries, strict=True):
        information[i, j] = information[j, i] = entry.symbol
    log_det = 2 * ca.sum1(ca.log(ca.diag(ca.chol(information))))
    output = Output(log_det / len(p), "1", "log det of the information per parameter")
    flat = [(r, c) for r in range(len(model.x)) for c in range(len(p))]
    return replace(
        model,
        name=f"informative {model.name}",
        x=(*model.x, *(replace(S[r][c], start=start[r, c]) for r, c in flat), *entries),
        ode=ca.vertcat(
            model.ode, *(rate[r, c] for r, c in flat), *(growth[i, j] for i, j in lower)
        ),
        xdot=ca.SX(0, 1), residual=ca.SX(0, 1),
        outputs={**model.outputs, "information": output},
        holonomic=None, contacts=(), opening=None,
    )  # fmt: skip


def expected_errors(free: Sequence[str], motion: NamedSignals) -> dict[str, float]:
    """Return the smallest relative standard errors of the parameters after a motion.

    Args:
        free: parameters in the order given to `informative`.
        motion: motion of the informative model, whose last values are used.
    """
    I = np.zeros((len(free), len(free)))  # noqa: E741  (the letter of the literature)
    for i, a in enumerate(free):
        for j, b in enumerate(free[: i + 1]):
            I[i, j] = I[j, i] = float(motion[_name(a, b)][-1])
    return dict(zip(free, np.sqrt(np.diag(np.linalg.inv(I))).tolist(), strict=True))


def _sensitivity(state: Variable, p: Variable) -> Variable:
    doc = f"change of {state.name} with a relative change of {p.name}"
    return Variable(f"S_{state.name}_{p.name}", state.unit, nominal=state.nominal, doc=doc)


def _name(a: str, b: str) -> str:
    return f"I_{a}_{b}"
