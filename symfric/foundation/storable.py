"""Classes that a file may name, and the checks that their fields pass."""

from dataclasses import MISSING, Field, fields
from functools import cached_property
from importlib import import_module
from typing import Any

from symfric.foundation import typed

OWN = ("symfric", "ocp", "identification")
"""Packages whose classes are known."""
MODULES = (
    "symfric.foundation.instructions", "symfric.foundation.packed", "symfric.foundation.status",
    "symfric.foundation.variable", "symfric.laws.", "symfric.model.", "symfric.scenes.",
    "symfric.multibody.joint", "symfric.results.ensemble", "symfric.results.statistics",
    "symfric.integrator.stored", "symfric.integrator.derivatives.path",
    "symfric.integrator.equations.inputs", "symfric.integrator.running.record",
    "ocp.checking.verification", "ocp.solving.motion", "ocp.solving.solution", "ocp.formulation.",
    "ocp.transcription.program",
    "ocp.transcription.unknowns", "ocp.transcription.schemes",
    "identification.data.", "identification.fit", "identification.residuals.closed_loop",
    "identification.residuals.inverse", "identification.residuals.points",
    "identification.residuals.shooting", "identification.result.", "identification.unknowns.spec",
    "identification.verdict.",
)  # fmt: skip
"""Modules whose classes a file may name; a dot at the end means all modules of that package."""
MOVED = {
    "symfric.integrator.running.dense": "symfric.integrator.running.record",
    "symfric.integrator.running.events": "symfric.integrator.running.record",
    "symfric.integrator.derivatives.seeds": "symfric.integrator.derivatives.path",
    "symfric.laws.base.curve": "symfric.laws.base.families",
    "symfric.laws.base.facts": "symfric.laws.base.law",
    "symfric.laws.base.sticking": "symfric.laws.base.families",
    "symfric.laws.composed.normalised": "symfric.laws.composed.wrap",
    "symfric.laws.cost": "symfric.laws.composed.populations",
    "symfric.laws.dynamic.armstrong": "symfric.laws.dynamic.dwell",
    "symfric.laws.dynamic.bliman_sorine": "symfric.laws.dynamic.dahl",
    "symfric.laws.dynamic.bouc_wen": "symfric.laws.dynamic.dahl",
    "symfric.laws.dynamic.bristle_2d": "symfric.laws.dynamic.stick_slip",
    "symfric.laws.dynamic.elasto_plastic": "symfric.laws.dynamic.lugre",
    "symfric.laws.dynamic.exact_coulomb": "symfric.laws.dynamic.stick_slip",
    "symfric.laws.dynamic.gms": "symfric.laws.dynamic.maxwell_slip",
    "symfric.laws.dynamic.gonthier": "symfric.laws.dynamic.dwell",
    "symfric.laws.dynamic.haessig_friedland": "symfric.laws.dynamic.stick_slip",
    "symfric.laws.dynamic.leuven": "symfric.laws.dynamic.maxwell_slip",
    "symfric.laws.dynamic.rate_and_state": "symfric.laws.dynamic.dwell",
    "symfric.laws.static.brown_mcphee": "symfric.laws.static.smooth_peak",
    "symfric.laws.static.falling": "symfric.laws.static.smooth_peak",
    "symfric.laws.static.joints": "symfric.laws.static.machines",
    "symfric.laws.static.quarter_car": "symfric.laws.static.machines",
    "symfric.laws.static.rui_wang": "symfric.laws.static.self_tuning",
    "symfric.laws.static.stribeck": "symfric.laws.static.exponential",
    "symfric.laws.static.table": "symfric.laws.static.coulomb",
    "symfric.laws.static.threlfall": "symfric.laws.static.piecewise",
    "symfric.multibody.friction": "symfric.multibody.joint",
    "symfric.scenes.arm": "symfric.scenes.spatial",
    "symfric.scenes.clutch": "symfric.scenes.rotating",
    "symfric.scenes.coupled_blocks": "symfric.scenes.blocks",
    "symfric.scenes.drawn": "symfric.scenes.base",
    "symfric.scenes.drill_string": "symfric.scenes.rotating",
    "symfric.scenes.drive": "symfric.scenes.blocks",
    "symfric.scenes.four_bar": "symfric.scenes.linkages",
    "symfric.scenes.four_mass": "symfric.scenes.spatial",
    "symfric.scenes.mechanism": "symfric.scenes.linkages",
    "symfric.scenes.nip": "symfric.scenes.rotating",
    "symfric.scenes.pendulum": "symfric.scenes.linkages",
    "symfric.scenes.pendulum_box": "symfric.scenes.linkages",
    "symfric.scenes.prescribed": "symfric.scenes.rigs",
    "symfric.scenes.quarter_car": "symfric.scenes.rigs",
    "symfric.scenes.rabinowicz": "symfric.scenes.blocks",
    "symfric.scenes.robot": "symfric.scenes.spatial",
    "symfric.scenes.slider_crank": "symfric.scenes.linkages",
    "ocp.formulation.bounds": "ocp.formulation.phase",
    "ocp.formulation.serialise": "ocp.formulation.problem",
    "ocp.result.motion": "ocp.solving.motion",
    "ocp.result.solution": "ocp.solving.solution",
    "ocp.solvers.outcome": "ocp.transcription.program",
    "ocp.text.choice": "ocp.formulation.statement",
    "ocp.text.posed": "ocp.formulation.problem",
    "ocp.text.ranges": "ocp.formulation.phase",
    "ocp.text.span": "ocp.formulation.phase",
    "ocp.transcription.points": "ocp.transcription.unknowns",
    "identification.data.loop": "identification.data.record",
    "identification.result.curve": "identification.result.series",
    "identification.result.estimate": "identification.result.series",
    "identification.signals.differentiate": "identification.data.differentiate",
    "identification.signals.filters": "identification.data.filters",
    "identification.signals.velocity": "identification.data.filters",
    "identification.verdict.whiteness": "identification.verdict.colour",
}
"""Module in older files -> module that holds its classes now."""
OURS = tuple(f"{package}{mark}" for package in OWN for mark in ".:")


def path_of(named: Any) -> str:
    """Return module and name of a class or function."""
    return f"{named.__module__}:{named.__qualname__}"


def current(path: str) -> str:
    """Return the present path of a class or function that a file may name by an older one."""
    place, _, name = path.partition(":")
    return f"{MOVED.get(place, place)}:{name}"


def found_at(path: str) -> Any:
    """Return the class or function of this path.

    Raises:
        ImportError, AttributeError, ValueError: there is none.
    """
    place, _, name = path.partition(":")
    found: Any = import_module(place)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def may_hold(path: str) -> bool:
    """Return True if a file may name this class: one of `MODULES`, or of another package."""
    inside = (path.startswith(m if m.endswith(".") else f"{m}:") for m in MODULES)
    return not path.startswith(OURS) or any(inside)


def checked(kind: type, values: dict[str, Any]) -> dict[str, Any]:
    """The fields of a class of ours, of the annotated types; missing ones have their defaults."""
    known = {item.name: item for item in fields(kind)}
    for name, value in values.items():
        hint = _hint(kind, known.get(name), name)
        if not typed.fits(value, hint):
            raise ValueError(f"{kind.__name__}.{name}: expected {hint}, got {value!r:.60}")
    for item in known.values():
        if item.name not in values:
            made_by = item.default_factory
            values[item.name] = item.default if made_by is MISSING else made_by()
        if values[item.name] is MISSING:
            raise ValueError(f"{kind.__name__}: expected {item.name}, got none")
    return values


def _hint(kind: type, item: "Field[Any] | None", name: str) -> Any:
    """The type of a field in a file, or of a cached property that is kept along with the fields."""
    if item is not None:
        return item.metadata.get("packed", typed.hints_of(kind)[name])
    if not isinstance(made := vars(kind).get(name), cached_property):
        raise ValueError(f"{kind.__name__}: expected its fields, got {name}")
    return typed.hints_of(made.func)["return"]
