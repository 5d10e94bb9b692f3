"""Force balance of any model with the measured motion inserted."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.differentiate import Velocity, derivatives, noise_of
from identification.data.filters import Filter, choose_filter
from identification.data.record import Record
from identification.residuals.sampled import Sampled, begun, imposed_step, moving_start, usual
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.laws import Law
from symfric.laws.base.law import require_law
from symfric.model import Model
from symfric.model.contact import Contact

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Put = Callable[[ca.SX], ca.SX]

SOME = 1000
"""Largest number of samples that determine the usual speeds of contacts."""
ALIKE = 1e-6
"""Share of a force direction below which other directions reproduce it."""


class Coordinate(NamedTuple):
    """Degree of freedom with the symbols of its motion.

    Attributes:
        position: position among the states of the model; None if only its rate is a state.
        rate: rate among the states of the model.
        a: symbol of the acceleration.
    """

    position: Variable | None
    rate: Variable
    a: ca.SX


class ForceRow(NamedTuple):
    """Force balance solved for an input, or for the remainder of a coordinate without an input.

    Attributes:
        signal: name of the input, or "balance of <rate>".
        unit: unit of the input or of the balance.
        input: index of the input among those of the model, or None.
        coordinate: index of the coordinate whose motion determines the balance.
        slips: indices of the contacts whose friction enters the balance.
    """

    signal: str
    unit: str
    input: int | None
    coordinate: int
    slips: tuple[int, ...]


class Balance(NamedTuple):
    """Equations of the inverse dynamics in w = (positions, rates, accelerations, inputs, time).

    Attributes:
        rows: descriptions of the rows of `equations`.
        equations: equations in w and the unknown parameters p.
        slips: (w, p) -> sliding velocities of the contacts and their derivatives by the rates.
        slopes: derivatives of the rows by rates and accelerations in steady sliding, row by row;
            None for rows with algebraic unknowns.
        loaded: True if a law depends on the applied force.
        preloads: contacts with bristles. Their preloads (`begun`) follow p in `equations`.
    """

    rows: tuple[ForceRow, ...]
    equations: Sampled
    slips: ca.Function
    slopes: Sampled | None
    loaded: bool
    preloads: tuple[str, ...]


def coordinates(model: Model, where: str) -> tuple[Coordinate, ...]:
    """Return the degrees of freedom of `model`: pairs x' = v, and rates without a position.

    Raises:
        ValueError: the model is implicit.
    """
    if model.ode is None:
        raise ValueError(f"{where}: expected explicit equations, got a residual; use Shooting()")
    if model.holonomic is not None:
        n, x = model.holonomic.n, model.x
        return tuple(Coordinate(x[i], x[n + i], model.holonomic.a[i]) for i in range(n))
    own = {v.name for c in model.contacts for v in c.states}
    motion = [k for k, v in enumerate(model.x) if v.name not in own]
    pairs = [(i, j) for i in motion for j in motion if i != j]
    rate = {i: j for i, j in pairs if ca.is_equal(model.ode[i], model.x[j].symbol)}
    position = {j: model.x[i] for i, j in rate.items()}
    return tuple(
        Coordinate(position.get(k), model.x[k], model.xdot[k])
        for k in motion
        if k in position or k not in rate
    )


def measured(model: Model, found: Sequence[Coordinate]) -> ca.SX:
    """Return the symbols w: positions (zero if absent), rates, accelerations, inputs, time."""
    q = [ca.SX.sym("none") if c.position is None else c.position.symbol for c in found]
    v, a = symbols_of(c.rate for c in found), stacked(c.a for c in found)
    return ca.vertcat(*q, v, a, model.vector("u"), model.t)


def balance(
    model: Model, names: Sequence[str], found: Sequence[Coordinate], seen: Array, where: str
) -> Balance:
    """Return the balance of forces of `model` with its parameters `names` as unknowns.

        r = input needed for the measured motion - measured input  rows with an input
        r = unexplained force of the measured motion               other rows

    If each input drives exactly one coordinate, r is the balance of the coordinate divided by the
    gain of the input. Otherwise, and in mechanisms with constraints, the inputs are algebraic
    unknowns like the multipliers, and as many coordinates as lack an input carry the remainder.
    States of laws follow the measured sliding velocity (`imposed_step`).

    Args:
        model: model with explicit equations, or a mechanism.
        names: free parameters; other parameters have their start values.
        found: `coordinates` of the model.
        seen: values of w (see `measured`) in the records, (nw, n). Force directions are compared
            at their medians.
        where: beginning of the messages.

    Raises:
        ValueError: more inputs than coordinates, or law states with modes that only a simulation
            can follow.
    """
    put = _closing(model, [v for v in model.p if v.name not in names])
    w, u = measured(model, found), model.vector("u")
    z = stacked(v.symbol for c in model.contacts for v in c.states)
    p = stacked(v.symbol for v in model.p if v.name in names)
    e, e_open, g, units = _balances(model, found)
    e = put(e)
    gains = -ca.jacobian(e_open, u)
    rubs = _pattern(ca.jacobian(e_open, stacked(c.force for c in model.contacts)))
    drives = _pattern(gains)
    phi = None if model.holonomic is None else model.holonomic.phi
    y, guess = model.vector("z"), [_number(v.start, v.nominal) for v in model.z]
    simple = (drives.sum(0) == 1).all() and (drives.sum(1) <= 1).all()
    if simple and (phi is None or phi.is_empty()):
        driven = {int(np.flatnonzero(on)[0]): i for i, on in enumerate(drives) if on.any()}
        bearing = [i for i, on in enumerate(drives) if not on.any()]
        balanced = [e[i] / gains[i, k] for k, i in driven.items()]
        rows = put(stacked([*balanced, *(e[i] for i in bearing)]))
    else:
        bearing = _bearing(model, put(gains), w, np.median(seen, axis=1), where)
        needed = ca.SX.sym("needed", len(model.u))
        rest = ca.SX.sym("rest", len(bearing))
        selected = ca.DM.eye(len(found))[:, bearing]
        free = ca.substitute(ca.vertcat(e, put(g)), u, needed)
        g = free - ca.vertcat(ca.mtimes(selected, rest), ca.SX.zeros(g.numel()))
        y, guess = ca.vertcat(needed, rest, y), [*[0.0] * (len(model.u) + len(bearing)), *guess]
        rows = ca.vertcat(needed - u, rest)
        driven = {k: int(np.argmax(drives[:, k])) for k in range(len(model.u))}
        rubs = np.ones_like(rubs)
    slips = [tuple(np.flatnonzero(on).tolist()) for on in rubs]
    known = [ForceRow(model.u[k].name, model.u[k].unit, k, i, slips[i]) for k, i in driven.items()]
    known += [
        ForceRow(f"balance of {found[i].rate.name}", units[i], None, i, slips[i]) for i in bearing
    ]
    count = len(found)
    slip = put(stacked(c.slip for c in model.contacts))
    by_rate = ca.vec(ca.jacobian(slip, w[count : 2 * count, 0]))
    slipping = ca.Function("slips", [w, p], [ca.densify(slip), ca.densify(by_rate)])
    values = np.array([_number(v.start, 1.0) for v in model.p if v.name in names])
    preloads, shares = _preloads(model.contacts, seen, values, slipping)
    start, steady, step, later, h = _states(model.contacts, preloads, w, y, put, where)
    g = put(g)
    equations = Sampled.of(
        w, ca.vertcat(p, shares), rows, z=z, start=start, step=step, later=later, h=h, y=y, g=g,
        guess=guess,
    )  # fmt: skip
    moved = ca.jacobian(ca.substitute(rows, z, steady), w[count : 3 * count, 0])
    slopes = None if y.numel() else Sampled.of(w, p, ca.vec(ca.densify(moved).T))
    loaded = ca.depends_on(ca.vertcat(g, step), u)
    return Balance(tuple(known), equations, slipping, slopes, loaded, tuple(preloads))


def _preloads(
    contacts: Sequence[Contact], seen: Array, p: Array, slipping: ca.Function
) -> tuple[dict[str, tuple[float, ca.SX]], ca.SX]:
    """Return contact -> usual speed and symbol of its preload, and the symbols as a column."""
    some = seen[:, :: 1 + seen.shape[1] // SOME]
    speeds = slipping.map(some.shape[1])(some, np.repeat(p[:, None], some.shape[1], 1))[0].full()
    bent = [k for k, c in enumerate(contacts) if not all(state.even for state in c.law.states)]
    shares = ca.SX.sym("preload", len(bent))
    return {contacts[k].name: (usual(speeds[k]), shares[i]) for i, k in enumerate(bent)}, shares


class MeasuredMotion(NamedTuple):
    """Measured motion and inputs of one record.

    Attributes:
        name: name of the record.
        t: times (n,) [s].
        step: sample interval [s].
        w: positions, rates, accelerations, inputs, time, shape (nw, n).
        velocities: measured rates with the spectra of their noise.
        filter: filter of the record.
    """

    name: str
    t: Array
    step: float
    w: Array
    velocities: tuple[Velocity, ...]
    filter: Filter

    @property
    def inputs(self) -> slice:
        """Rows of `w` that contain the inputs."""
        return slice(3 * len(self.velocities), -1)

    @property
    def inside(self) -> slice:
        """Samples unaffected by the end effects of the filter."""
        return self.filter.inside(self.t.size, self.step)

    @property
    def begin(self) -> Array:
        """First sample of `w`, with rates near rest set to zero."""
        first, count = self.w[:, 0].copy(), len(self.velocities)
        first[count : 2 * count] = [moving_start(v) for v in self.w[count : 2 * count]]
        return first

    def shifted(self, delay: float) -> tuple[Array, Array]:
        """Return `w` with the inputs u(t - delay), and du/dt at t - delay, shape (inputs, n)."""
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 (slow to import)

        spline: Any = CubicSpline(self.t, self.w[self.inputs], axis=1)
        at = np.clip(self.t - delay, self.t[0], self.t[-1])
        w = self.w.copy()
        w[self.inputs] = spline(at)
        return w, np.asarray(spline(at, 1))


def measure(
    model: Model,
    found: Sequence[Coordinate],
    record: Record,
    called: Mapping[str, str],
    filter: Filter | None,
    noise: Mapping[str, float],
) -> MeasuredMotion:
    """Differentiate a record with the channels that the model needs.

    Args:
        model: the model.
        found: `coordinates` of the model.
        record: equally spaced samples.
        called: name in the model -> channel, if they differ.
        filter: the filter; None: chosen for the fastest input, or without inputs for the fastest
            motion.
        noise: channel -> standard deviation of its noise, if known.

    Raises:
        ValueError: channels are missing, or intervals are unequal.
    """
    step = record.uniform().step
    known = ca.vertcat(ca.SX(0, 1) if model.ode is None else model.ode, model.alg)
    missing, raw = list[str](), list[tuple[Array | None, Array | None]]()
    known_noise = list[tuple[float | None, ...]]()
    for c in found:
        names = [None if s is None else called.get(s.name, s.name) for s in (c.position, c.rate)]
        x, v = (record[n] if n is not None and n in record else None for n in names)
        needed, given = (c.rate, v) if c.position is None else (c.position, x)
        if given is None and (v is None or ca.depends_on(known, needed.symbol)):
            missing.append(called.get(needed.name, needed.name))
        raw.append((x, v))
        known_noise.append(tuple(noise_of(record, n, noise) for n in names))
    inputs = [called.get(u.name, u.name) for u in model.u]
    missing += [n for n in inputs if n not in record]
    if missing:
        raise ValueError(
            f"data '{record.name}': expected channels {', '.join(missing)} for the inverse "
            f"dynamics of '{model.name}', got {', '.join(record.signals)}; rename columns, or use "
            "Shooting() for motion that is not measured"
        )
    forces = [record[n] for n in inputs]
    both = zip(raw, known_noise, strict=True)
    velocities = tuple(Velocity.of(*signals, step, *sizes) for signals, sizes in both)
    if filter is None:
        moved = [np.gradient(cast(Array, x), step) if v is None else v for x, v in raw]
        bands = [t.band(x, v, step) for t, (x, v) in zip(velocities, raw, strict=True)]
        each = (choose_filter(signal, step, bands) for signal in forces or moved)
        filter = max(each, key=lambda f: f.cutoff)
    motion = [derivatives(x, v, step, filter, t) for t, (x, v) in zip(velocities, raw, strict=True)]
    w = np.vstack([*(part[k] for k in range(3) for part in motion), *forces, record.time])
    return MeasuredMotion(record.name, record.time, step, w, velocities, filter)


def _balances(model: Model, found: Sequence[Coordinate]) -> tuple[ca.SX, ca.SX, ca.SX, list[str]]:
    """Return balances of the coordinates, the same with open contacts, other equations, units."""
    mechanics, opened = model.holonomic, model.open.holonomic
    if mechanics is None or opened is None:
        a = stacked(c.a for c in found)

        def left(of: Model) -> ca.SX:
            place = {v.name: k for k, v in enumerate(of.x)}
            return a - stacked(cast(ca.SX, of.ode)[place[c.rate.name]] for c in found)

        units = [f"{c.rate.unit}^2" if c.rate.unit.endswith("/s") else "" for c in found]
        return left(model), left(model.open), ca.SX(model.alg), units
    n, m = mechanics.n, mechanics.phi.numel()
    units = ["N m" if c.rate.unit.startswith("rad") else "N" for c in found]
    return mechanics.implicit[:n, 0], opened.implicit[:n, 0], mechanics.implicit[n + m :, 0], units


def _states(
    contacts: Sequence[Contact],
    preloads: Mapping[str, tuple[float, ca.SX]],
    w: ca.SX,
    y: ca.SX,
    put: Put,
    where: str,
) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return start, steady state, step, later symbols and interval of the states of all laws.

    `preloads` are the usual speed and the symbol of the preload of each contact with bristles.
    """
    later, h = ca.SX.sym("later", w.numel() + y.numel()), ca.SX.sym("h")
    now, start, steady, step = ca.vertcat(w, y), list[ca.SX](), list[ca.SX](), list[ca.SX]()
    for c in contacts:
        if not c.states:
            continue
        at = f"{where}: contact '{c.name}'"
        require_law(at, c.law)
        law = cast(Law, c.law)
        here = [put(x) for x in (c.slip, c.N, *c.given.values())]
        then = [ca.substitute(x, now, later) for x in here]
        before, after = ((x[0], x[1], dict(zip(c.given, x[2:], strict=True))) for x in (here, then))
        steady.append(put(ca.SX(law.steady_state_at(c.slip, c.N, **c.given))))
        speed, share = preloads.get(c.name, (0.0, ca.SX(0.0)))
        start.append(put(begun(law, (c.slip, c.N), speed, share)))
        step.append(put(imposed_step(law, symbols_of(c.states), before, after, h, at)))
    return stacked(start), stacked(steady), stacked(step), later, h


def _closing(model: Model, held: Sequence[Variable]) -> Put:
    """Return a substitution of laws for friction forces and of numbers for held parameters."""
    force = stacked(c.force for c in model.contacts)
    friction = stacked(c.friction for c in model.contacts)
    symbols, numbers = symbols_of(held), ca.SX(starts_of(held))

    def put(expression: ca.SX) -> ca.SX:
        found = ca.SX(expression)
        for _ in model.contacts:
            if not ca.depends_on(found, force):
                break
            found = ca.substitute(found, force, friction)
        return ca.substitute(found, symbols, numbers) if symbols.numel() else found

    return put


def _bearing(model: Model, gains: ca.SX, w: ca.SX, typical: Array, where: str) -> list[int]:
    """Return the coordinates that carry forces not balanced by inputs or constraints."""
    directions = gains
    if model.holonomic is not None:
        q = model.vector("x")[: model.holonomic.n, 0]
        directions = ca.horzcat(directions, ca.jacobian(model.holonomic.phi, q).T)
    at = ca.Function("directions", [w, model.vector("p")], [ca.densify(directions)])
    pushes = at(typical, np.array([_number(v.start, 1.0) for v in model.p])).full()
    pushes /= np.maximum(np.linalg.norm(pushes, axis=0), 1e-300)
    n, count = pushes.shape
    if count > n or (count and np.linalg.svd(pushes, compute_uv=False)[-1] < ALIKE):
        raise ValueError(
            f"{where}: expected inputs with independent directions, got {len(model.u)} inputs and "
            f"{count - len(model.u)} constraints on {n} coordinates; hold or remove an input"
        )
    chosen = list[int]()
    taken = np.linalg.qr(pushes)[0] if count else np.zeros((n, 0))
    for _ in range(n - count):
        k = int(np.argmax(1.0 - np.sum(taken**2, axis=1)))
        chosen.append(k)
        new = np.eye(n)[:, k] - taken @ taken[k]
        taken = np.column_stack([taken, new / np.linalg.norm(new)])
    return chosen


def _pattern(slopes: ca.SX) -> Mask:
    """Return a mask of the structural nonzeros of a matrix."""
    return np.array(ca.DM(slopes.sparsity(), 1).full() != 0).reshape(slopes.shape)


def _number(start: object, otherwise: float) -> float:
    return float(start) if is_number(start) else otherwise  # type: ignore[arg-type]
