"""Equilibria: rest with sticking contacts, steady sliding, and the loads that rest survives."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf, isnan
from typing import Any, Literal, final

import numpy as np
from scipy.optimize import brentq

from symfric.dynamics.balance import FORCE, SLIP, STILL, UP, LinearCondition, settled, with_modes
from symfric.dynamics.equations import ModelEquations, TangentEquations, equations, tangent
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable
from symfric.model import Model, check_model
from symfric.results.trajectory import Trajectory

CONSERVED = 1e-8
"""Relative singular value of A below which a combination of states is constant."""
FARTHEST, GROWTH = 1e9, 2.0
"""Largest load of the search, relative to its typical size, and growth of its steps."""


@final
@dataclass(frozen=True)
class Holding:
    """One contact in an equilibrium.

    Attributes:
        name: name of the contact.
        state: "stick" without sliding velocity, else "slip".
        slip: sliding velocity [m/s].
        force: friction force F [N], with the sign of the slip in steady sliding.
        level: largest force [N] at rest in the direction of F; NaN if the law does not define it.
    """

    name: str
    state: Literal["stick", "slip"]
    slip: float
    force: float
    level: float

    @property
    def margin(self) -> float:
        """Static level minus |F| [N] at the present normal force; negative above the level.

        The load of a self-energising brake raises its level: `survives` includes this.
        """
        return self.level - abs(self.force)


@final
@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Showing):
    """State of a model in which all rates vanish; `at["friction"]` is the value of a signal.

    Attributes:
        model: the model.
        x, z, u, p: states, algebraic variables, inputs and parameters by name.
        drift: rates [1/s times the unit] of cyclic states, on which no equation depends, such as
            the position of a drive at constant speed.
        contacts: sliding velocity, force and static level of each contact.
        free: number of directions in which neighbouring states are equilibria, without cyclic
            states. A contact that sticks holds any force within its level.
        y: all unknowns.
    """

    model: Model
    x: Mapping[str, float]
    z: Mapping[str, float]
    u: Mapping[str, float]
    p: Mapping[str, float]
    drift: Mapping[str, float]
    contacts: tuple[Holding, ...]
    free: int
    y: Array
    hidden = Showing.hidden | {"y", "equations", "data", "tangent"}

    def __getitem__(self, name: str) -> float:
        expression = self.model.expression(name)
        return float(self.equations.expressed(expression)(self.y, self.data))

    @property
    def equations(self) -> ModelEquations:
        """Equations of the model at constant inputs."""
        return equations("equilibrium", self.model)

    @cached_property
    def data(self) -> Array:
        """Values of inputs and parameters."""
        return np.array([*self.u.values(), *self.p.values()], dtype=float)

    @cached_property
    def tangent(self) -> TangentEquations:
        """Linear equations in the tangent space of the constraints."""
        return tangent(self.equations, self.y, self.data)

    def survives(self, name: str) -> tuple[float, float]:
        """Return the interval of an input or parameter in which all contacts at rest hold.

        The load changes slowly from its present value. Sticking contacts keep their positions, and
        all other states follow in equilibrium. At an end of the interval, a contact carries its
        static level, or no equilibrium continues; without such an end it is -inf or inf.

        Raises:
            ValueError: an unknown name, no contact at rest, or a contact whose law creeps under
                load, as laws with a smooth sign do, or has no static level.
        """
        where = f"equilibrium of '{self.model.name}': survives"
        check_names(where, [name], [*self.u, *self.p], "free a parameter when the model is made")
        held = [c for c in self.contacts if c.state == "stick"]
        if not held:
            raise ValueError(f"{where}: expected a contact at rest, got none; all of them slide")
        laws = {c.name: c.law for c in self.model.contacts}
        if loose := [c.name for c in held if isnan(c.level) or not laws[c.name].states]:
            raise ValueError(
                f"{where}: expected laws that hold a load at rest, got others for "
                f"{', '.join(loose)}; use a law with modes or bristles, such as ExactCoulomb"
            )
        return _end(self, name, -1.0), _end(self, name, 1.0)

    def shown(self) -> Shown:
        """Return states, algebraic variables and contacts."""
        values = {**self.x, **self.z}
        rows = [
            (v.name, f"{values[v.name]:.6g}", v.unit, "") for v in (*self.model.x, *self.model.z)
        ]
        rows += [
            (f"{name}'", f"{rate:.6g}", "", "drifts") for name, rate in self.drift.items() if rate
        ]
        for c in self.contacts:
            level = "" if isnan(c.level) else f", level {c.level:.6g} at this normal force"
            rows.append((c.name, f"{c.force:.6g}", "N", f"{c.state}s{level}"))
        lines = (f"one of a set of equilibria of dimension {self.free}",) * bool(self.free)
        table = TextTable(("", "value", "unit", ""), tuple(rows), numbers=(1,))
        return Shown(f"equilibrium of '{self.model.name}'", lines, table)


def equilibrium(
    model: Model,
    *,
    u: Mapping[str, float] | None = None,
    p: Mapping[str, float] | None = None,
    guess: "Mapping[str, float] | Trajectory | Equilibrium | None" = None,
) -> Equilibrium:
    """Return the equilibrium of a model next to a guess: rest, or steady sliding.

        0 = f(x, z, u, p)   with constant inputs

    The rates of all states vanish, except those of cyclic states, on which no equation depends. A
    contact on a moving belt slides; between bodies at rest it sticks. Laws with modes
    (`ExactCoulomb`) stick under any force up to their static level, bristle laws with any
    deflection. Such equilibria form sets (`Equilibrium.free`). The result is the one whose states,
    without those of friction laws, are nearest to the guess in multiples of their nominal values.
    If its contacts cannot hold it, the one without force in the contacts at rest is tried. A smooth
    law has no force without sliding velocity: under load it creeps, and rest is an equilibrium only
    without load. Equations that depend on time are refused. `linearize` returns the stability.

    Args:
        model: explicit or implicit model, or a mechanism.
        u: constant inputs by name; others have their default values.
        p: values of free parameters by name.
        guess: states by name, an equilibrium, or a run, whose last state is used; by default the
            start values of the model. It selects one of several equilibria.

    Raises:
        ValueError: bad input, or no equilibrium was found near the guess.
    """
    check_model("equilibrium", model)
    eq = equations("equilibrium", model)
    d = eq.data(u, p)
    found = with_modes(eq, _start(eq, guess, p), d)
    if found is None:
        raise ValueError(
            f"equilibrium: expected an equilibrium of '{model.name}' near the guess, got none; "
            "give a guess near one, such as a settled run, or inputs that allow one"
        )
    return _result(eq, *found, d)


def _start(
    eq: ModelEquations, guess: "Mapping[str, float] | Trajectory | Equilibrium | None",
    p: Mapping[str, float] | None,
) -> Array:  # fmt: skip
    """Return the first guess of all unknowns."""
    model, own = eq.model, [v.name for v in eq.model.x]
    known = {v.name: float(v.start) for v in model.z}
    if isinstance(guess, Trajectory):
        guess.check(own)
        known |= guess.final
        guess = {name: known[name] for name in own}
    elif isinstance(guess, Equilibrium):
        known |= guess.z
        guess = guess.x
    x = model.initial_state(guess, p)
    return np.concatenate([x, [known.get(name, 0.0) for name in eq.names[x.size :]]])


def _result(eq: ModelEquations, y: Array, free: int, d: Array) -> Equilibrium:
    """Return the equilibrium with the unknowns `y`."""
    model, nu = eq.model, len(eq.model.u)
    y[eq.modes] = np.round(y[eq.modes])
    x, z = y[: len(model.x)], dict(zip(eq.names, y.tolist(), strict=True))
    rates = np.linalg.lstsq(eq.M, eq.values(y, d)[0].full().ravel(), rcond=None)[0]
    return Equilibrium(
        model,
        dict(zip((v.name for v in model.x), x.tolist(), strict=True)),
        {v.name: z[v.name] for v in model.z},
        dict(zip((v.name for v in model.u), d[:nu].tolist(), strict=True)),
        dict(zip((v.name for v in model.p), d[nu:].tolist(), strict=True)),
        {model.x[i].name: float(rates[i]) for i in eq.cyclic},
        _contacts(eq, y, d),
        free,
        y,
    )


def _contacts(eq: ModelEquations, y: Array, d: Array) -> tuple[Holding, ...]:
    """Return the state of each contact."""
    found, scale = list[Holding](), eq.scale[: len(eq.model.x)].max(initial=0.0)
    for c, row in zip(eq.model.contacts, eq.contacts(y, d).full(), strict=True):
        slip, force = float(row[SLIP]), float(row[FORCE])
        level = float(row[UP + (force < 0)])
        state = "stick" if abs(slip) <= STILL * scale else "slip"
        found.append(Holding(c.name, state, slip, force, level))
    return tuple(found)


def _root(function: Callable[[float], float], low: float, high: float, xtol: float) -> float:
    """Return the root of a function that changes its sign between two numbers."""
    found: Any = brentq(function, low, high, xtol=xtol)
    return float(found)


def _end(at: Equilibrium, name: str, side: float) -> float:
    """Return the load at which the first contact slips, if it changes in the direction `side`."""
    eq, y_0, d_0 = at.equations, at.y, at.data
    k = [*at.u, *at.p].index(name)
    held = [i for i, c in enumerate(at.contacts) if c.state == "stick"]
    linear = at.tangent
    u, s, _ = np.linalg.svd(linear.A)
    still = u[:, s <= CONSERVED * max(1.0, s.max(initial=0.0))].T
    condition = LinearCondition(np.zeros((still.shape[0], y_0.size)), y_0)
    condition.W[:, linear.states] = still
    last = y_0

    def margin(load: float) -> float:
        """Return the smallest margin relative to its level; -1 without an equilibrium."""
        nonlocal last
        d = d_0.copy()
        d[k] = load
        found = settled(eq, last, d, condition)
        if found is None:
            return -1.0
        rows = eq.contacts(found[0], d).full()[held]
        force = rows[:, FORCE]
        level = np.where(force < 0, rows[:, UP + 1], rows[:, UP])
        share = float(((level - np.abs(force)) / np.maximum(level, 1e-300)).min())
        last = found[0] if share > 0 else last
        return max(share, -1.0)

    variables = (*at.model.u, *at.model.p)
    typical = max(abs(d_0[k]), variables[k].nominal)
    near, step = float(d_0[k]), 1e-3 * typical
    while step < FARTHEST * typical:
        far = near + side * step
        if margin(far) < 0:
            return _root(margin, near, far, 1e-14 * typical)
        near, step = far, GROWTH * step
    return side * inf
