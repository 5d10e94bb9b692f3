"""Class `Subject`: the law, machine or model of a fit, with its free parameters as symbols."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, final

import casadi as ca

from identification.unknowns import roles
from identification.unknowns.spec import (
    Draft,
    Requests,
    Tied,
    Unknown,
    drafted,
    of_variable,
    refuse,
)
from symfric.foundation import checks
from symfric.foundation.numeric import is_number, is_symbolic
from symfric.foundation.parameters import Parameter, Variable, parameters, symbolise, with_values
from symfric.foundation.units import turned
from symfric.foundation.variable import POSITIVE, symbols_of
from symfric.laws import Law
from symfric.model import Model, Output, Variables
from symfric.scenes import Drive
from symfric.scenes.base import Scene


class Closed(NamedTuple):
    """Law and machine (None if there is none) and model of a subject, with numbers."""

    law: Law | None
    scene: Scene | None
    model: Model


@final
@dataclass(frozen=True, eq=False)
class Subject:
    """Law, machine or model to be fitted, with symbols for its free parameters.

    Attributes:
        name: name of the law or the model.
        free: free parameters including tied ones, starting at the values of the law; all are among
            the symbols `model.p`.
        requests: arguments of the user.
        model: equations with the free parameters as symbols `p`. For a law fitted to points, the
            inputs are v, N and the further inputs of the law, and the output is F. Held parameters
            of a model are symbols, too; their start is their value.
        law: law with numbers; None for a model that does not have exactly one law.
        scene: machine with numbers; None for a law alone or a model.
        reasons: held parameter -> reason.
        held: held parameter -> value.
        variables: parameter -> name, unit, bounds and doc, for all parameters.
        guard: function from free values by name to the law or machine with numbers; raises
            ValueError if a law refuses them.
    """

    name: str
    free: dict[str, Unknown]
    requests: Requests
    model: Model
    law: Law | None
    scene: Scene | None
    reasons: dict[str, str]
    held: dict[str, float]
    variables: dict[str, Variable]
    guard: Callable[[Mapping[str, float]], Law | Scene | None]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters, including tied ones."""
        return tuple(self.free)

    @property
    def ties(self) -> dict[str, Tied]:
        """Free parameters computed from others."""
        return self.requests.ties

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Free parameters that have a coordinate."""
        return tuple(u for n, u in self.free.items() if n not in self.ties)

    @property
    def drive(self) -> Drive | None:
        """The machine if it is a `Drive`, otherwise None."""
        return self.scene if isinstance(self.scene, Drive) else None

    @property
    def load(self) -> float | None:
        """Normal force of a drive or of points [N]; None if there is no single load."""
        if self.drive is not None:
            return float(self.drive.N)
        loads = [v.start for v in self.model.u if v.name == "N"] if self.scene is None else []
        return float(loads[0]) if loads and self.law is not None else None

    def close(self, values: Mapping[str, float]) -> Closed:
        """Replace the symbols by numbers; in the model, they become starts of its parameters.

        Raises:
            ValueError: the law refuses the values.
        """
        mine = {n: float(values[n]) for n in self.names}
        p = tuple(replace(v, start=mine.get(v.name, v.start)) for v in self.model.p)
        opening = self.model.opening
        opening = None if opening is None else partial(_open, opening, p)
        whole, model = self.guard(mine), replace(self.model, p=p, opening=opening)
        if isinstance(whole, Scene):
            return Closed(whole.law, whole, model)
        return Closed(whole, None, model)


def _open(opening: Callable[[], Model], p: Variables) -> Model:
    """Return the model with open contacts, starting at the values of `p`."""
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
    natural: roles.Natural | None = None,
) -> Subject:
    """Decide which parameters are fitted, and formulate the model with symbols.

    Args:
        what: a law or its text, which is fitted as a `Drive` (with `points` as a law alone); a
            scene; or a model, of which all parameters are free.
        free: names, or name -> specification, fitted in addition to those fitted by their role.
        fixed: name -> value of held parameters; "others": all that are not in `free`.
        start: names of parameters with a start given elsewhere, to be checked with the others.
        normal_force: N of a law [N]; with 1 N, coefficients are forces.
        points: True if the data are forces at given velocities, not a motion.
        moving: True if the data show changes of the states of a law; None: True unless `points`.
        turning: True if positions are angles.
        v_max: largest speed in the data [m/s or rad/s]; 0: unknown.
        v_min: smallest speed of measured points; 0: unknown, or a motion through rest.
        natural: natural units of the data of a law or a drive.

    Raises:
        ValueError: all problems, in one error.
    """
    requests = Requests(free, fixed, start)
    if isinstance(what, Model):
        return _of_model(what, requests)
    if isinstance(what, str):
        from symfric.laws.catalogue import law_from_text  # noqa: PLC0415 (slow to import)

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
    known = natural if natural is not None and isinstance(what, Law | Drive) else roles.Natural()
    return _of_parts(what, requests, load, moving, turning, roles.Speeds(v_max, v_min), known)


def _of_parts(
    whole: Scene | Law, requests: Requests, load: float, moving: bool, turning: bool,
    speeds: roles.Speeds, natural: roles.Natural,
) -> Subject:  # fmt: skip
    """Return the subject of a law (for points) or of a scene (for a motion)."""
    from symfric.laws.catalogue import law_name  # noqa: PLC0415 (slow to import)

    known = parameters(whole)
    symbols = [n for n, p in known.items() if not is_number(p.value)]
    if symbols:
        shown = f"symbols or arrays for {', '.join(symbols)}; name them in free="
        raise ValueError(f"Fit: expected numbers as start values, got {shown}")
    requests.check([n for n in known if n != "N" or not isinstance(whole, Drive)])
    units = {n: turned(p.unit) if turning else p.unit for n, p in known.items()}
    variables = {
        n: Variable(n, units[n], q.value, lower=q.lower, upper=q.upper, doc=q.doc)
        for n, q in known.items()
    }
    small = natural.rescaled(whole, defaults=True) if natural != roles.Natural() else whole
    reasons = _reasons(small, requests, load / natural.load, moving)
    given, sizes = requests.fixed, natural.sizes(whole)
    held = {n: given.get(n, roles.held_value(known[n], speeds, sizes[n])) for n in reasons}
    names, default = [n for n in known if n not in reasons], whole

    def started() -> tuple[Scene | Law, dict[str, Unknown]]:
        drafts = [of_parameter(known[n], units[n], speeds, sizes[n]) for n in names]
        free = drafted(drafts, requests, held, roles.orders(default))
        return with_values(default, held | {n: u.start for n, u in free.items()}), free

    whole, free = started()
    if natural != roles.Natural():  # held values determine the forces of viscous coefficients
        law = whole if isinstance(whole, Law) else whole.law
        sizes |= natural.viscous(law, names, speeds.largest, load)
        whole, free = started()
    symbolic, p = symbolise(whole, *free)
    law, scene = (whole, None) if isinstance(whole, Law) else (whole.law, whole)
    model = points_model(symbolic, load, p) if isinstance(symbolic, Law) else symbolic.equations(p)
    x = tuple(replace(v, nominal=v.nominal * natural.of_unit(v.unit)) for v in model.x)
    model = replace(model, x=x)
    guard = partial(with_values, whole)
    why = {n: reasons[n] for n in variables if n in reasons}
    return Subject(law_name(law), free, requests, model, law, scene, why, held, variables, guard)


def of_parameter(parameter: Parameter, unit: str, speeds: roles.Speeds, size: float) -> Draft:
    """Return the draft of a parameter of a law or a scene according to its role.

    Its default is a number in its natural unit `size`.
    """
    value, logarithmic = float(parameter.value), roles.is_logarithmic(parameter)
    default = size * parameter.default
    if 0 < parameter.lower <= POSITIVE:
        parameter = replace(parameter, lower=0.0)
    start = default if value == parameter.default else value
    unknown = Unknown(
        parameter.name, unit, start, *roles.window(parameter, speeds),
        scale=abs(start) or abs(default) or size, logarithmic=logarithmic,
    )  # fmt: skip
    return Draft(unknown, parameter.lower, parameter.upper)


def _reasons(whole: Scene | Law, requests: Requests, load: float, moving: bool) -> dict[str, str]:
    """Return held parameter -> reason."""
    known = parameters(whole)
    if requests.only:
        return {n: "given" for n in known if n not in requests.free}
    law = whole if isinstance(whole, Law) else whole.law
    strange = set[str]() if isinstance(whole, Law | Drive) else known.keys() - parameters(law)
    directions, bristle = roles.has_directions(whole), moving if law.states else None
    reasons = {
        n: roles.reason(p, directions=directions, bristle=bristle, machine=n in strange)
        for n, p in known.items()
        if n not in requests.free
    }
    reasons |= dict.fromkeys(requests.fixed, "given")
    names = [*requests.free, *(n for n in known if n in reasons and not reasons[n])]
    reasons |= roles.inseparable(law, load, names, set(requests.free), bool(bristle))
    return {n: text for n, text in reasons.items() if text}


def points_model(law: Law, load: float, p: Variables) -> Model:
    """Return a model of the force F of a law in steady sliding, with inputs v, N and others."""
    v, N = Variable("v", "m/s", nominal=0.1), Variable("N", "N", start=load, nominal=load)
    further = tuple(Variable(i.name, i.unit, start=i.steady, nominal=i.nominal) for i in law.inputs)
    inputs = {x.name: x.symbol for x in further}
    z = ca.SX(law.steady_state_at(v.symbol, N.symbol, **inputs)) if law.states else ca.SX(0, 1)
    F = Output(ca.SX(law.force(v.symbol, N.symbol, z, **inputs)), "N", "friction force opposing v")
    return Model(name="points", u=(v, N, *further), p=p, outputs={"F": F})


def _of_model(model: Model, requests: Requests) -> Subject:
    """Return the subject of a model, with all its parameters free unless fixed."""
    variables = {v.name: v for v in model.p}
    if not variables:
        raise ValueError("Fit: expected a model with parameters, got none; scene.model(free=[...])")
    requests.check([*variables])
    given = [n for n in variables if requests.only and n not in requests.free]
    reasons = dict.fromkeys([*requests.fixed, *given], "given")
    odd = [n for n, v in variables.items() if not is_number(v.start)]
    refuse([f"{n}: expected a number as start value, got an expression" for n in odd])
    held = {n: requests.fixed.get(n, float(variables[n].start)) for n in variables if n in reasons}
    laws = [c.law for c in model.contacts if isinstance(c.law, Law)]
    orders = [pair for law in laws for pair in roles.symbols_in_order(law)]
    drafts = [of_variable(v) for n, v in variables.items() if n not in reasons]
    free = drafted(drafts, requests, held, orders)
    starts = held | {n: u.start for n, u in free.items()}
    p = tuple(replace(v, start=starts[v.name]) for v in model.p)
    guard = Laws.of(laws, p)
    model, why = replace(model, p=p), {n: reasons[n] for n in variables if n in reasons}
    return Subject(model.name, free, requests, model, guard({}), None, why, held, variables, guard)


@final
@dataclass(frozen=True, eq=False)
class Laws:
    """Laws of the contacts of a model as functions of the parameters of the model."""

    laws: tuple[tuple[Law, ca.Function, tuple[str, ...]], ...]
    starts: dict[str, float]

    @classmethod
    def of(cls, laws: Sequence[Law], p: Variables) -> "Laws":
        """Return the functions of laws whose parameters are expressions in `p`."""
        plain: list[tuple[Law, ca.Function, tuple[str, ...]]] = []
        starts = {v.name: float(v.start) for v in p}
        for law in laws:
            written = {n: q.value for n, q in parameters(law).items() if is_symbolic(q.value)}
            values = ca.densify(ca.vertcat(*written.values()))
            value = ca.Function("value", [symbols_of(p)], [values])
            start = value([*starts.values()]).full().ravel().tolist()
            numeric = with_values(law, dict(zip(written, start, strict=True)))
            plain.append((numeric, value, tuple(written)))
        return cls(tuple(plain), starts)

    def __call__(self, values: Mapping[str, float]) -> Law | None:
        """Return the law with numbers if there is only one, otherwise None; check all laws."""
        p = [values.get(name, start) for name, start in self.starts.items()]
        made = [
            with_values(law, dict(zip(names, at(p).full().ravel().tolist(), strict=True)))
            for law, at, names in self.laws
        ]
        return made[0] if len(made) == 1 else None
