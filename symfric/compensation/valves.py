"""Stiction of control valves: maps from the output of a controller to the position of the valve."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.codegen import Block
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import symbols_of
from symfric.laws.base import smooth
from symfric.model import Output

SHAPE = """x = u -+ (S - J)/2 while the valve moves
x stays after a reversal until u has moved back by S, then jumps by J
"""


class Form(NamedTuple):
    """Form of the map.

    Attributes:
        source: publication.
        step: function (z, u, S, J) -> states after the step.
        states: descriptions of the states by name.
    """

    source: str
    step: Callable[[ca.SX, ca.SX, ca.SX, ca.SX], ca.SX]
    states: dict[str, str]


def _kano(z: ca.SX, u: ca.SX, S: ca.SX, J: ca.SX) -> ca.SX:
    before, x, u_s, stuck, du_before, d = ca.vertsplit(z)
    du = u - before
    stops = ca.logic_and(du * du_before <= 0, stuck < 0.5)
    u_s, stuck = ca.if_else(stops, before, u_s), ca.logic_or(stops, stuck > 0.5)
    turns = ca.logic_and(stuck, -d * (u - u_s) > S)
    moves = ca.logic_or(ca.logic_or(ca.logic_not(stuck), turns), d * (u - u_s) > J)
    d = ca.if_else(turns, -d, d)
    x = ca.if_else(moves, u - d * (S - J) / 2, x)
    return ca.vertcat(u, x, u_s, ca.logic_not(moves), du, d)


def _choudhury(z: ca.SX, u: ca.SX, S: ca.SX, J: ca.SX) -> ca.SX:
    before, x, u_s, stuck, way_before = ca.vertsplit(z)
    way = ca.sign(u - before)
    same, stuck = way == way_before, stuck > 0.5
    u_s = ca.if_else(ca.logic_or(same, stuck), u_s, before)
    onward = ca.logic_and(same, ca.sign(u - u_s) * ca.sign(u_s - x) > 0)
    far = ca.if_else(onward, ca.fabs(u - u_s) > J, ca.fabs(u - x) > (S + J) / 2)
    moves = ca.if_else(same, ca.logic_or(ca.logic_not(stuck), far), ca.logic_and(way != 0, far))
    x = ca.if_else(moves, u - way * (S - J) / 2, x)
    return ca.vertcat(u, x, u_s, ca.logic_not(moves), way)


def _he(z: ca.SX, u: ca.SX, S: ca.SX, J: ca.SX) -> ca.SX:
    before, x, u_r = ca.vertsplit(z)
    pull = u_r + u - before
    moves, kept = ca.fabs(pull) > (S + J) / 2, ca.sign(pull) * (S - J) / 2
    return ca.vertcat(u, ca.if_else(moves, u - kept, x), ca.if_else(moves, kept, pull))


OLD = {"u_before": "u of the last step", "x": "position of the valve"}
FLAG = {"stuck": "1 at rest, 0 in motion"}
STOP = "u at which the valve stopped"
FORMS = {
    "kano": Form(
        "Kano, Maruta, Kugemoto, Shimizu, IFAC DYCOPS 2004", _kano,
        {**OLD, "u_s": STOP, **FLAG, "du_before": "change of u", "d": "last direction"},
    ),
    "choudhury": Form(
        "Choudhury, Thornhill, Shah, Control Eng. Practice 13, 2005", _choudhury,
        {**OLD, "u_stop": STOP, **FLAG, "way_before": "sign of the change of u"},
    ),
    "he": Form(
        "He, Wang, Pottmann, Qin, Ind. Eng. Chem. Res. 46, 2007", _he,
        {**OLD, "u_r": "part of u that friction balances"},
    ),
}  # fmt: skip
"""Forms of the map by name, as in the flow charts of their papers."""


def _at_rest(names: Iterable[str], u: ca.SX, S: ca.SX, J: ca.SX) -> ca.SX:
    """Return the states of a valve at rest at x = u without residual force."""
    values = {"u_before": u, "x": u, "u_s": u + (S - J) / 2, "u_stop": u, "stuck": 1, "d": 1}
    return ca.vertcat(*(ca.SX(values.get(name, 0)) for name in names))


def valve_stiction(S: float, J: float, *, form: str = "kano", name: str | None = None) -> Block:
    """Return the map from the output u of a controller to the position x of a sticking valve.

        x follows u at the distance (S - J)/2 while the valve moves
        x stays after a reversal until u has moved back by S, then jumps by J

    S is the deadband plus the stick band, J the slip jump, both in the unit of u. J = 0 is
    backlash, S = J = 0 is x = u. The block makes one step per sample of the controller; it has no
    sample time and no inertia, so it is no force law. At the start, the valve rests at u = x = 0,
    where it moves at |u| > (S + J)/2. The reset `rest` begins at rest at the input u instead.

    kano        stops and reversals are seen in the changes of u; a stopped valve that continues in
                its direction must pass J again
    choudhury   the same by the sign of the rate of u and the distance of u from x
    he          the force balance f_s = (S + J)/2, f_d = (S - J)/2: the valve stops at every sample,
                so that a slow ramp gives steps of J

    Limits: the flow charts hold u within 0 to 100 %; limit u before. One sample of noise that
    reverses the change of u stops the valve. J > S, overshoot, is meant for the form "kano".
    Source: the papers in `FORMS`.
    Checked: the equations of a public simulator, fellipegm/valve_estimation, for all forms.

    Args:
        S, J: stickband and slip jump, start values of the parameters.
        form: "kano", "choudhury" or "he".
        name: C identifier; default "valve_stiction".

    Raises:
        ValueError: bad input; J > S with form "he", which has no negative friction.
    """
    where = "valve_stiction"
    checks.check_names(f"{where}: form", [form], FORMS)
    checks.number(f"{where}: S", S, lower=0.0)
    checks.number(f"{where}: J", J, lower=0.0)
    if form == "he" and J > S:
        raise ValueError(f"{where}: expected J <= S for the form he, got J = {J:g} and S = {S:g}")
    made, own = FORMS[form], where if name is None else checks.text(f"{where}: name", name)
    u = Variable("u", "1", doc="output of the controller")
    parameters = (
        Variable("S", "1", start=S, doc="deadband plus stick band", lower=0.0),
        Variable("J", "1", start=J, doc="slip jump", lower=0.0),
    )
    s, j = (p.symbol for p in parameters)
    starts = ca.DM(_at_rest(made.states, ca.SX(0), ca.SX(S), ca.SX(J))).full().ravel()
    named = zip(made.states.items(), starts.tolist(), strict=True)
    states = tuple(Variable(n, "1", start=start, doc=doc) for (n, doc), start in named)
    after = made.step(symbols_of(states), u.symbol, s, j)
    return Block(
        own,
        doc=f"Stiction of a control valve, form {form}.",
        states=states,
        inputs=(u,),
        parameters=parameters,
        next=after,
        outputs={"position": Output(after[1], "1", "position of the valve")},
        resets={"rest": (_at_rest(made.states, u.symbol, s, j), "the valve rests at the input u")},
        equations=SHAPE,
        sources=(made.source,),
    )


def valve_describing_function(S: float, J: float, amplitudes: ArrayLike) -> NDArray[np.complex128]:
    """Return the first harmonic of the position of a sticking valve for u = A sin(w t), over A.

        N(A) = -(P - i Q) / (pi A),   phi = arcsin((A - S) / A)
        P = A/2 sin(2 phi) - 2 A cos(phi) - A (pi/2 + phi) + 2 (S - J) cos(phi)
        Q = -3 A/2 + A/2 cos(2 phi) + 2 A sin(phi) - 2 (S - J) sin(phi)

    A loop with the linear part G oscillates near the frequency and amplitude at which
    G(i w) = -1/N(A). N does not depend on the frequency; it is 0 for A <= S/2, where the valve
    rests. A valve at rest begins to move at A > (S + J)/2 only.
    Limits: many samples per period. The form "he" of `valve_stiction` has this harmonic for J = 0
    only, "choudhury" for J <= S.
    Source: Choudhury, Thornhill, Shah, Control Eng. Practice 13, 2005.

    Args:
        S, J: deadband plus stick band, and slip jump.
        amplitudes: A > 0, shape (k,).

    Raises:
        ValueError: bad input.
    """
    where = "valve_describing_function"
    band = checks.number(f"{where}: S", S, lower=0.0)
    lag = band - checks.number(f"{where}: J", J, lower=0.0)
    given = checks.array(f"{where}: amplitudes", amplitudes)
    if not (given > 0).all():
        raise checks.refused(f"{where}: amplitudes", "amplitudes > 0", amplitudes)
    A = np.maximum(given, band / 2)
    phi = np.arcsin(smooth.clip((A - band) / A, -1.0, 1.0))
    real = A / 2 * np.sin(2 * phi) - 2 * A * np.cos(phi) - A * (np.pi / 2 + phi)
    imaginary = -1.5 * A + A / 2 * np.cos(2 * phi) + 2 * A * np.sin(phi)
    value = real + 2 * lag * np.cos(phi) - 1j * (imaginary - 2 * lag * np.sin(phi))
    return np.where(given > band / 2, -value / (np.pi * A), 0.0)
