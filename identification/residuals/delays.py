"""Dead time of inputs: what a model feels is what was recorded, a while earlier.

    u(t) = recorded(t - tau),     du/dtau = -recorded'(t - tau)

Between samples an input is linear, so its rate is constant there and jumps at the samples. With a
further parameter theta, which stays 0, the model is driven by u - theta u_rate: its derivative by
theta is that of the motion by tau, whatever the model.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import stacked
from symfric.integrator import Hold
from symfric.model import Model

Array = NDArray[np.float64]
DEAD_TIME = "dead_time"
"""Name of the unknown and of the parameter of a delayed model."""
RATE = "_rate"
"""Behind the name of an input: its rate."""


def delayed(model: Model, inputs: Sequence[str]) -> Model:
    """The model with a parameter `dead_time` (0) and the rates of `inputs` as inputs."""
    theta = Variable(DEAD_TIME, "s", nominal=1e-3, doc="0; derivatives by it are by the dead time")
    driven = [v for v in model.u if v.name in inputs]
    rates = [Variable(v.name + RATE, f"{v.unit}/s", nominal=v.nominal) for v in driven]
    old = stacked(v.symbol for v in driven)
    new = old - theta.symbol * stacked(v.symbol for v in rates)

    def put(expression: Any) -> ca.SX:
        return ca.substitute(ca.SX(expression), old, new)

    changes: dict[str, Any] = {
        "u": (*model.u, *rates),
        "p": (*model.p, theta),
        "outputs": {n: replace(o, expression=put(o.expression)) for n, o in model.outputs.items()},
        "monitors": tuple(replace(m, expression=put(m.expression)) for m in model.monitors),
        "events": tuple(
            replace(e, expression=put(e.expression), reset={n: put(v) for n, v in e.reset.items()})
            for e in model.events
        ),
    }
    if model.holonomic is not None:
        mechanics = model.holonomic
        parts = {n: put(getattr(mechanics, n)) for n in ("implicit", "rates", "pressing")}
        changes |= {"holonomic": replace(mechanics, **parts), "ode": None, "alg": ca.SX(0, 1)}
    elif model.ode is None:
        changes["residual"] = put(model.residual)
    else:
        changes |= {"ode": put(model.ode), "alg": put(model.alg)}
    return replace(model, **changes)


def rate(t: Array, values: Array) -> Hold:
    """Rate of linear samples, 0 before the first and after the last one."""
    begin = np.concatenate([[t[0] - (t[1] - t[0])], t])
    return Hold(begin, np.concatenate([[0.0], np.diff(values) / np.diff(t), [0.0]]))
