"""Base class of scenes, which are parametric machines with a friction law, and their contacts."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, ClassVar, Self, final

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_number, is_symbolic
from symfric.foundation.parameters import (
    Parametric,
    Variable,
    parameters,
    parametric,
    symbolise,
    with_values,
)
from symfric.foundation.shown import WIDTH
from symfric.foundation.variable import check_si, strays, symbols_of
from symfric.laws import Law
from symfric.laws.base.law import require_law
from symfric.model import Contact, Model, Output, Variables
from symfric.model.contact import APPLIED
from symfric.scenes.presets import Preset, presets_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False)
class GivenInput:
    """Default input of a scene: a function of time, and the text that describes it."""

    text: str
    function: Callable[[ca.SX], ca.SX]


class _Published:
    """Descriptor for the presets of a class of scenes, which reads them at first use."""

    def __get__(self, scene: "Scene | None", kind: "type[Scene]") -> Mapping[str, Preset]:
        return presets_of(kind)


@parametric
class Scene(Parametric, ABC):
    """Machine with a friction law; `model()` returns its equations.

    Raises:
        ValueError: a parameter of the scene or the law is an array or an MX symbol. A scene
            requires numbers or SX symbols; `simulate_many` runs many values.
    """

    t_end: ClassVar[float]
    """Time [s] of a typical motion, such as three stick-slip periods."""

    inputs: ClassVar[Mapping[str, GivenInput]] = {}
    """Default inputs by name."""

    integrals: ClassVar[Mapping[str, str]] = {}
    """Inputs that are the rate of a state, by state.

    The command line accepts samples of the state instead of the input.
    """

    presets = _Published()
    """Parameters from publications by name, see `preset` and presets.toml."""

    law: Law

    @classmethod
    def places(cls) -> dict[str, str]:
        """Return the descriptions of the fields created by `other_law`, by keyword."""
        return _marked(cls, "place")

    @classmethod
    def structures(cls) -> dict[str, str]:
        """Return the descriptions of the fields created by `structure`, by keyword."""
        return _marked(cls, "structure")

    @classmethod
    def preset(cls, name: str, law: Law, **others: Any) -> Self:
        """Return the scene and `law` with the parameters of a publication.

        Args:
            name: one of `presets`.
            law: any law; a law that the publication does not use gets only the levels of friction.
            others: further fields of the scene: laws, such as `hinge`, which also get the
                parameters of their contact, or parameters that replace those of the publication.

        Raises:
            ValueError: the preset does not exist, or the scene rejects an argument.
        """
        where = f"{cls.__name__}: preset"
        checks.text(where, name, "the name of a preset")
        checks.check_names(where, [name], cls.presets)
        require_law(cls.__name__, law)
        chosen = cls.presets[name]
        laws = {"law": law} | {place: law for place in cls.places() if place in chosen.friction}
        laws |= {n: value for n, value in others.items() if isinstance(value, Law)}
        laws |= {n: chosen.friction[n].given(laws[n]) for n in laws if n in chosen.friction}
        arguments: dict[str, Any] = {**chosen.values, **others, **laws}
        return cls(**arguments)

    def law_of(self, place: str) -> Law:
        """Return the law of one of `places`; by default `law`."""
        special = getattr(self, place)
        return self.law if special is None else special

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        cls.__repr__ = Scene.__repr__  # replaces the single-line text of the dataclass

    def __repr__(self) -> str:
        """Return the call that creates the scene, wrapped to the width of a terminal."""
        values = ", ".join(f"{item.name}={getattr(self, item.name)!r}" for item in fields(self))
        text = f"{type(self).__name__}({values})"
        return fill(text, WIDTH, subsequent_indent="    ", break_long_words=False)

    def thumbnail(self) -> "Figure | None":
        """Return the small figure of `law`."""
        return self.law.thumbnail()

    def __post_init__(self) -> None:
        require_law(type(self).__name__, self.law)
        for place in type(self).places():
            if getattr(self, place) is not None:
                require_law(f"{type(self).__name__}: {place}", getattr(self, place))
        super().__post_init__()
        several = [n for n, p in parameters(self).items() if not _is_scalar(p.value)]
        if several:
            raise ValueError(
                f"{type(self).__name__}: expected one number or SX symbol for each parameter, got "
                f"an array or MX for {', '.join(several)}; simulate_many(p=...) runs many values"
            )

    def schematic(self, path: str | Path | None = None) -> "Figure":
        """Return a labelled figure of the machine, 85 mm wide.

        It has bodies, springs, dampers, the symbols of parameters, coordinates and velocities
        (blue) and inputs (green) with their positive directions, and contacts with friction with
        their loads (orange).

        Args:
            path: output file; its suffix (.png, .svg, .pdf) selects the format.

        Raises:
            ValueError: the model has no sketch, or the suffix is unknown.
        """
        from symfric.results.schematic import schematic  # noqa: PLC0415  (slow to import)

        laws = parameters(self.law)
        return schematic(self.model(n for n in parameters(self) if n not in laws), path)

    @abstractmethod
    def equations(self, p: Variables) -> Model:
        """Return the model of this machine with the parameters `p`."""

    def model(self, free: Iterable[str] = ()) -> Model:
        """Return the model, with the parameters named in `free` as symbols in `Model.p`.

        All other parameters are constants of the equations, so terms multiplied by zero vanish.
        """
        name = type(self).__name__
        scene, p = symbolise(self, *checks.names(f"{name}: free", free))
        known, own = parameters(scene).items(), symbols_of(p)
        if held := [n for n, q in known if is_symbolic(q.value) and strays(q.value, own)]:
            raise ValueError(
                f"{name}: expected numbers, got a symbol for {', '.join(held)}; "
                f"free={held} makes parameters of the model"
            )
        return scene.equations(p)


def other_law(doc: str) -> Any:
    """Declare a field of a scene for the law of another contact, or None.

    The parameters of this law are added to those of `law`, with the suffixes _1 and _2 for shared
    names.

    Args:
        doc: description of the contact and of its default friction.
    """
    return field(default=None, metadata={"place": doc})


def structure(default: bool | int, doc: str) -> Any:
    """Declare a field of a scene that determines its equations: a count or a truth value.

    Its value is chosen when the scene is created, so that the equations contain no branches. Use
    `option` for a choice between named forms.
    """
    return field(default=default, metadata={"structure": doc})


def _marked(kind: type[Scene], mark: str) -> dict[str, str]:
    return {item.name: item.metadata[mark] for item in fields(kind) if mark in item.metadata}


def _is_scalar(value: Scalar) -> bool:
    if isinstance(value, ca.SX | ca.DM):
        return value.numel() == 1
    return is_number(value) or (isinstance(value, np.ndarray) and value.ndim == 0)


def contact(
    name: str, law: Law, v: Scalar, N: Scalar, rest: Mapping[str, Scalar] | None = None,
    *, least: Scalar | None = None, bare: bool | None = None, turning: bool = False,
    **inputs: Scalar,
) -> Contact:  # fmt: skip
    """Return a contact of two bodies with the sliding velocity `v`, for user-defined equations.

    The equations contain `force` of the contact, and the contact is passed to the `Model`. The
    model then also has the states of the law, its changes of mode as events, and error control of
    the slip:

        x, v, pull = Variable("x", "m"), Variable("v", "m/s"), Variable("pull", "N")
        slip = contact("floor", LuGre(), v, 10.0)
        rate = (pull - slip.force) / 2.0
        sled = Model("sled", x=(x, v), u=(pull,), ode=casadi.vertcat(v, rate),
                     contacts=(slip,), outputs={"friction": Output(slip.force, "N")})

    Args:
        name: name of the contact.
        law: any law for a scalar sliding velocity.
        v: sliding velocity [m/s], a variable or an expression; `force` opposes it.
        N: normal force >= 0 [N], a number, a variable or an expression. Simulations do not check
            its sign; `Event("lift", N - least, -1, terminal=True)` ends them when bodies separate.
        rest: maps a state of the model to its value at which `v` is exactly zero, for laws that
            stick; by default a state of the model in which `v` is linear.
        least: smallest value of a varying `N`, at which the law must be defined.
        bare: True if states and events have the names of the law, False for "<name>_<state>", None
            for True if the model has only one contact.
        turning: True if `v` is a rate [rad/s] and `force` a moment [N m].
        inputs: further inputs of the law. The applied force F_e is the sum of all forces along the
            slip except friction. By default it is derived from the equations; it is required if the
            equations are implicit or have algebraic variables that depend on friction.

    Raises:
        ValueError: `law` is not a law, needs another input, or divides by N = 0; or a variable has
            a unit that is not an SI unit.
    """
    where = f"contact '{checks.text('contact: name', name, 'a text, and then a law')}'"
    require_law(f"{where}: law", law)
    check_si(f"{where}: v", v)
    if isinstance(N, Variable) and N.unit in ("m/s", "rad/s"):
        raise checks.refused(f"{where}: N", "a normal force", N, "v comes before N")
    if (load := checks.as_number(N)) is not None and load < 0:
        raise checks.refused(f"{where}: N", "a normal force >= 0 N", N)
    needed = [i for i in law.inputs if i.name not in (*inputs, APPLIED)]
    if needed:
        raise ValueError(
            f"{type(law).__name__}: expected a law that needs no more than v, N"
            f"{''.join(f', {offered}' for offered in inputs)} here, got one that needs "
            f"{', '.join(f'{i.name} ({i.doc})' for i in needed)}; "
            f"offer it by name, as in contact(..., {needed[0].name}=...)"
        )
    bottom = N if least is None else least
    if is_number(bottom) and bottom == 0 and divides_by_load(law):
        raise ValueError(
            f"{type(law).__name__}: expected a normal force above 0 N, by which the law divides, "
            "got 0; lugre_normalised does not, and load_dependent(...) rounds it off"
        )
    if least is not None and is_number(least):  # laws check their load only if it is a number
        law.rate(ca.SX(1.0), least, ca.SX([s.nominal for s in law.states]))
    v = checks.expression(f"{where}: v", v)
    turns = checks.flag(f"{where}: turning", turning)
    return Contact(name, ca.SX(v), N, law, given=inputs, rest=rest or {}, turning=turns, bare=bare)


def divides_by_load(law: Law) -> bool:
    """Return True if a law is not finite at N = 0, with default values in place of symbols."""
    known = parameters(law).items()
    law = with_values(law, {name: p.default for name, p in known if is_symbolic(p.value)})
    v, z = ca.SX(1.0), ca.SX([state.nominal for state in law.states])
    try:
        found = ca.veccat(law.force(v, 0.0, z), law.rate(v, 0.0, z))
    except (ValueError, ZeroDivisionError):
        return True
    return not found.is_regular()


def friction_outputs(slip: Contact, name: str) -> dict[str, Output]:
    """Return the outputs friction and power of a contact whose slip is the signal `name`."""
    return {
        "friction": Output(slip.force, slip.unit("N"), f"friction force opposing {name}"),
        "power": Output(slip.force * slip.slip, "W", "power taken by friction"),
    }
