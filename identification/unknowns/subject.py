"""Subject of a fit: a law, a machine or a model, with its free parameters as symbols."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import casadi as ca

from identification.unknowns import roles
from identification.unknowns.drafts import (
    Wishes,
    drafted,
    of_parameter,
    of_variable,
    refuse,
    wishes,
)
from identification.unknowns.spec import Tied, Unknown
from symfric.foundation import checks
from symfric.foundation.numeric import is_number, is_symbolic
from symfric.foundation.parameters import Variable, parameters, symbolise, with_values
from symfric.foundation.units import turned
from symfric.foundation.variable import symbols_of
from symfric.laws import Law
from symfric.model import Model, Output, Variables
from symfric.scenes import Drive
from symfric.scenes.base import Scene


@final
@dataclass(frozen=True, eq=False)
class Closed:
    """The subject with numbers: law and machine if it has them, and the model."""

    law: Law | None
    scene: Scene | None
    model: Model


@final
@dataclass(frozen=True, eq=False)
class Subject:
    """A law, machine or model to be fitted, with symbols for its free parameters.

    Attributes:
        name: of the law, or of the model.
        names: free parameters, tied ones included; all are among the symbols `model.p`.
        model: its equations with the free parameters as symbols `p`; for a law fitted to points
            with inputs v, N and further inputs of the law, and the output F. Held parameters of a
            model are symbols, too; their start is their value.
        law: the law with numbers; None for a model that does not have exactly one law.
        scene: the machine with numbers; None for a law alone or a model.
        unknowns: free parameters with a coordinate, starting at the values of the law.
        ties: free parameters computed from others.
        reasons: held parameter -> reason.
        held: held parameter -> value.
        variables: parameter -> name, unit, bounds and doc, for all parameters.
        guard: function of free values by name that returns the law or the machine; it raises
            ValueError if a law refuses them; without symbols.
        started: parameters with a start value given by the user.
    """

    name: str
    names: tuple[str, ...]
    model: Model
    law: Law | None
    scene: Scene | None
    unknowns: tuple[Unknown, ...]
    ties: dict[str, Tied]
    reasons: dict[str, str]
    held: dict[str, float]
    variables: dict[str, Variable]
    guard: Callable[[Mapping[str, float]], Law | Scene | None]
    started: frozenset[str] = frozenset()

    @property
    def drive(self) -> Drive | None:
        """The machine, if it is a mass with a force input."""
        return self.scene if isinstance(self.scene, Drive) else None

    def close(self, values: Mapping[str, float]) -> Closed:
        """Insert numbers for the symbols; the model keeps them as starts of its parameters.

        Raises:
            ValueError: values that the law refuses.
        """
        mine = {n: float(values[n]) for n in self.names}
        p = tuple(replace(v, start=mine.get(v.name, v.start)) for v in self.model.p)
        whole, model = self.guard(mine), restarted(self.model, p)
        if isinstance(whole, Scene):
            return Closed(whole.law, whole, model)
        return Closed(whole, None, model)


def restarted(model: Model, p: Variables) -> Model:
    """Return the model with other starts of its parameters, also if its contacts are open."""
    opening = None if model.opening is None else partial(_open, model.opening, p)
    return replace(model, p=p, opening=opening)


def _open(opening: Callable[[], Model], p: Variables) -> Model:
    made, known = opening(), {v.name: v for v in p}
    return replace(made, p=tuple(known.get(v.name, v) for v in made.p))


def subject(
    what: object,
    *,
    free: object = None,
    fixed: object = None,
    start: Iterable[str] = (),
    normal_force: float = 1.0,
    points: bool = False,
    moving: bool | None = None,
    turning: bool = False,
    v_max: float = 0.0,
    v_min: float = 0.0,
) -> Subject:
    """Decide which parameters are fitted, and formulate the model with symbols.

    Args:
        what: a law or its text, which becomes a `Drive` (with `points`: the law alone); a scene; a
            model, of which all parameters are free.
        free: names, or name -> specification, fitted in addition to those fitted by their role.
        fixed: name -> value of held parameters; "others": all that are not in `free`.
        start: names of parameters with a start given elsewhere, to be checked with the others.
        normal_force: N of a law [N]; with 1 N coefficients read as forces.
        points: the data are forces at given velocities, not a motion.
        moving: the data show how the states of a law change; None: True unless they are points.
        turning: positions are angles.
        v_max: largest speed in the data [m/s or rad/s]; 0: unknown.
        v_min: least speed of measured points; 0: unknown, or a motion through rest.

    Raises:
        ValueError: all problems, in one error.
    """
    wished = wishes(free, fixed, start)
    if isinstance(what, Model):
        return _of_model(what, wished)
    if isinstance(what, str):
        from symfric.laws import law_from_text  # noqa: PLC0415 (slow to import)

        what = law_from_text(what)
    if not isinstance(what, Law | Scene):
        such = "a law or its text such as 'stribeck', a scene such as Drive(...), or a model"
        raise checks.refused("Fit: what", such, what)
    load = checks.number("Fit: normal_force", normal_force, unit="N", above=0.0)
    if points:
        what = what.law if isinstance(what, Scene) else what
    elif isinstance(what, Law):
        what = Drive(what, N=load, turning=turning)
    elif isinstance(what, Drive):
        turning = what.turning
    moving = not points if moving is None else moving
    return _of_parts(what, wished, _Setting(load, moving, turning, roles.Speeds(v_max, v_min)))


@final
@dataclass(frozen=True)
class _Setting:
    """Setting of the data: normal force [N], changing states, angles, speeds."""

    load: float
    moving: bool
    turning: bool
    speeds: roles.Speeds


def _of_parts(whole: Scene | Law, wished: Wishes, setting: _Setting) -> Subject:
    """Return the subject for a law (with points) or a scene (with a motion)."""
    from symfric.laws import law_name  # noqa: PLC0415 (slow to import)

    known = parameters(whole)
    symbols = [n for n, p in known.items() if not is_number(p.value)]
    if symbols:
        shown = f"symbols or arrays for {', '.join(symbols)}; name them in free="
        raise ValueError(f"Fit: expected numbers as start values, got {shown}")
    wished.check(n for n in known if n != "N" or not isinstance(whole, Drive))
    units = {n: turned(p.unit) if setting.turning else p.unit for n, p in known.items()}
    reasons = _reasons(whole, wished, setting)
    free = [n for n in known if n not in reasons]
    if not free:
        raise ValueError("Fit: expected at least one free parameter, got all fixed")
    held = {n: wished.fixed.get(n, roles.held_value(known[n], setting.speeds)) for n in reasons}
    limits = [of_parameter(known[n], units[n], setting.speeds) for n in free]
    drafts = drafted(limits, wished, held, list(roles.orders(whole)))
    whole = with_values(whole, held | {n: u.start for n, u in drafts.items()})
    symbolic, p = symbolise(whole, *free)
    model = (
        points_model(symbolic, setting.load, p)
        if isinstance(symbolic, Law)
        else symbolic.equations(p)
    )
    law, scene = (whole, None) if isinstance(whole, Law) else (whole.law, whole)
    ties = {n: s for n, s in wished.free.items() if isinstance(s, Tied)}
    mine = tuple(drafts[n] for n in free if n not in ties)
    return Subject(
        name=law_name(law),
        names=tuple(free),
        model=model,
        law=law,
        scene=scene,
        unknowns=mine,
        ties=ties,
        reasons={n: reasons[n] for n in known if n in reasons},
        held=held,
        variables={
            n: Variable(n, units[n], q.value, lower=q.lower, upper=q.upper, doc=q.doc)
            for n, q in known.items()
        },
        guard=partial(with_values, whole),
        started=wished.started,
    )


def _reasons(whole: Scene | Law, wished: Wishes, setting: _Setting) -> dict[str, str]:
    """Return the held parameters with the reason for each."""
    known = parameters(whole)
    law = whole if isinstance(whole, Law) else whole.law
    frictional = parameters(law)
    strange = not isinstance(whole, Law | Drive)
    directions, bristle = roles.has_directions(whole), setting.moving if law.states else None
    reasons = {
        n: roles.reason(
            p, directions=directions, bristle=bristle, machine=strange and n not in frictional
        )
        for n, p in known.items()
        if n not in wished.free
    }
    reasons |= dict.fromkeys(wished.fixed, "given")
    if wished.only:
        reasons |= {n: "given" for n in known if n not in wished.free}
        return reasons
    asked = [*wished.free, *(n for n in known if n not in wished.free and not reasons[n])]
    reasons |= roles.inseparable(law, setting.load, asked, set(wished.free), bool(bristle))
    return {n: text for n, text in reasons.items() if text}


def points_model(law: Law, load: float, p: Variables) -> Model:
    """Return a model of the force F of a law at given v, N and inputs; states in steady sliding."""
    v, N = Variable("v", "m/s", nominal=0.1), Variable("N", "N", start=load, nominal=load)
    further = tuple(Variable(i.name, i.unit, start=i.steady, nominal=i.nominal) for i in law.inputs)
    inputs = {x.name: x.symbol for x in further}
    if law.states:
        force = law.force(v.symbol, N.symbol, ca.SX(law.steady_state(v.symbol, N.symbol)), **inputs)
    else:
        force = law.force(v.symbol, N.symbol, ca.SX(0, 1), **inputs)
    F = Output(ca.SX(force), "N", "friction force opposing v")
    return Model(name="points", u=(v, N, *further), p=p, outputs={"F": F})


def _of_model(model: Model, wished: Wishes) -> Subject:
    """Return the subject for a model: all its parameters are free unless fixed."""
    names = [v.name for v in model.p]
    if not names:
        raise ValueError("Fit: expected a model with parameters, got none; scene.model(free=[...])")
    wished.check(names)
    reasons = dict.fromkeys(wished.fixed, "given")
    if wished.only:
        reasons |= {n: "given" for n in names if n not in wished.free}
    held = {v.name: wished.fixed.get(v.name, float(v.start)) for v in model.p if v.name in reasons}
    free = [v for v in model.p if v.name not in reasons]
    if not free:
        raise ValueError("Fit: expected at least one free parameter, got all fixed")
    laws = [c.law for c in model.contacts if isinstance(c.law, Law)]
    orders = [pair for law in laws for pair in roles.symbols_in_order(law)]
    odd = [v.name for v in model.p if not is_number(v.start)]
    refuse([f"{n}: expected a number as start value, got an expression" for n in odd])
    drafts = drafted([of_variable(v) for v in free], wished, held, orders)
    starts = held | {n: u.start for n, u in drafts.items()}
    p = tuple(replace(v, start=starts[v.name]) for v in model.p)
    guard = _guard(laws, p)
    ties = {n: s for n, s in wished.free.items() if isinstance(s, Tied)}
    return Subject(
        name=model.name,
        names=tuple(v.name for v in free),
        model=replace(model, p=p),
        law=guard({}),
        scene=None,
        unknowns=tuple(drafts[v.name] for v in free if v.name not in ties),
        ties=ties,
        reasons=reasons,
        held=held,
        variables={v.name: v for v in model.p},
        guard=guard,
        started=wished.started,
    )


def _guard(laws: Sequence[Law], p: Variables) -> "Laws":
    """Return a function that evaluates the model's laws, whose parameters are expressions in p."""
    plain: list[tuple[Law, ca.Function, tuple[str, ...]]] = []
    column = symbols_of(p)
    for law in laws:
        written = {n: q.value for n, q in parameters(law).items() if is_symbolic(q.value)}
        value = ca.Function("value", [column], [ca.densify(ca.vertcat(*written.values()))])
        start = value([float(v.start) for v in p]).full().ravel().tolist()
        numeric = with_values(law, dict(zip(written, start, strict=True)))
        plain.append((numeric, value, tuple(written)))
    return Laws(tuple(plain), tuple((v.name, float(v.start)) for v in p))


@final
@dataclass(frozen=True, eq=False)
class Laws:
    """The laws of a model's contacts as functions of its parameters."""

    laws: tuple[tuple[Law, ca.Function, tuple[str, ...]], ...]
    starts: tuple[tuple[str, float], ...]

    def __call__(self, values: Mapping[str, float]) -> Law | None:
        """Return the only law with numbers, None if there are several; ValueError if refused."""
        p = [values.get(name, start) for name, start in self.starts]
        made = [
            with_values(law, dict(zip(names, at(p).full().ravel().tolist(), strict=True)))
            for law, at, names in self.laws
        ]
        return made[0] if len(made) == 1 else None
