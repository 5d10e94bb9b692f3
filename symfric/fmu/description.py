"""modelDescription.xml of both versions of the standard, from the variables of a unit."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from typing import final
from xml.etree import ElementTree as Xml

from symfric.fmu.variables import Entry
from symfric.foundation.units import CELSIUS, exponents

CATEGORIES = ("logStatusDiscard", "logStatusError")
"""Messages come in any case: there are none but of what failed or was refused."""


@final
@dataclass(frozen=True, eq=False)
class Described:
    """What stands in modelDescription.xml beside the variables.

    Attributes:
        name: of the model.
        identifier: C identifier, the name of the binary.
        token: what ties the binary to the description.
        doc: what it is.
        tool: who made it.
        span: start and stop time [s] of the default experiment.
        rtol: tolerance of the default experiment; None with fixed steps.
        step: length [s] of fixed steps, None where the step is adaptive.
        interval: communication step [s] that is proposed.
        files: sources, the one to be compiled.
        exchange: whether it is for model exchange.
        slopes: whether it gives directional derivatives.
    """

    name: str
    identifier: str
    token: str
    doc: str
    tool: str
    span: tuple[float, float]
    rtol: float | None
    step: float | None
    interval: float
    files: tuple[str, ...]
    exchange: bool = False
    slopes: bool = False

    @property
    def tag(self) -> str:
        """What the standard calls its kind."""
        return "ModelExchange" if self.exchange else "CoSimulation"

    @property
    def variable_steps(self) -> bool | None:
        """Whether communication steps may be of any length; None where there are none."""
        return None if self.exchange else True


def described(what: Described, entries: Iterable[Entry], fmi: int) -> str:
    """The text of modelDescription.xml; `fmi` is 2 or 3."""
    root = (_second if fmi == 2 else _third)(what, tuple(entries))
    Xml.indent(root)
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def build_description(what: Described) -> str:
    """buildDescription.xml beside the sources, of 3.0."""
    root = Xml.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    build = _child(root, "BuildConfiguration", modelIdentifier=what.identifier)
    sources = _child(build, "SourceFileSet", language="C99")
    for name in what.files:
        _child(sources, "SourceFile", name=name)
    _child(build, "Library", name="m")
    Xml.indent(root)
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _child(parent: Xml.Element, tag: str, **attributes: object) -> Xml.Element:
    """A new element; attributes that are None are left out."""
    texts = {name: _text(value) for name, value in attributes.items() if value is not None}
    return Xml.SubElement(parent, tag, texts)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)


def _root(what: Described, version: str, **more: str) -> Xml.Element:
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    own = {"fmiVersion": version, "modelName": what.name} | more
    own |= {"description": what.doc, "generationTool": what.tool, "generationDateAndTime": now}
    return Xml.Element("fmiModelDescription", own | {"variableNamingConvention": "flat"})


def _units(root: Xml.Element, entries: Iterable[Entry]) -> None:
    """Every unit once, with its exponents where it is a product of SI units."""
    used = dict.fromkeys(entry.unit for entry in entries if entry.unit not in ("", "1"))
    if not used:
        return
    group = _child(root, "UnitDefinitions")
    for text in used:
        unit = _child(group, "Unit", name=text)
        base = {"K": 1} if text == CELSIUS else exponents(text)
        if base is not None:
            shift = 273.15 if text == CELSIUS else None
            _child(unit, "BaseUnit", **base, offset=shift)


def _experiment(root: Xml.Element, what: Described) -> None:
    _child(
        root, "DefaultExperiment", startTime=what.span[0], stopTime=what.span[1],
        tolerance=what.rtol, stepSize=what.interval,
    )  # fmt: skip


def _log(root: Xml.Element) -> None:
    group = _child(root, "LogCategories")
    for name in CATEGORIES:
        _child(group, "Category", name=name)


def _numbers(entry: Entry) -> dict[str, object]:
    """Attributes of a real variable that both versions have."""
    return {
        "unit": entry.unit if entry.unit not in ("", "1") else None,
        "nominal": entry.nominal,
        "min": entry.lower if isfinite(entry.lower) else None,
        "max": entry.upper if isfinite(entry.upper) else None,
        "start": entry.start,
    }


def _unknowns(entries: Iterable[Entry]) -> list[Entry]:
    """What is calculated at the start: outputs and states that are not set, and rates."""
    calculated = (e for e in entries if e.initial in ("approx", "calculated"))
    return [e for e in calculated if e.causality == "output" or e.kind == "rate"]


def _known(what: Described, entries: Iterable[Entry]) -> set[str]:
    """Names of what outputs may depend on."""
    kinds = ("state",) if what.exchange else ()
    return {e.name for e in entries if e.causality == "input" or e.kind in kinds}


def _needs(entry: Entry, known: set[str], number: Mapping[str, int]) -> dict[str, object]:
    """Attribute `dependencies`."""
    needs = sorted(number[name] for name in entry.needs if name in known)
    return {"dependencies": " ".join(map(str, needs))}


def _second(what: Described, entries: tuple[Entry, ...]) -> Xml.Element:
    """FMI 2.0, which has no variables for event indicators."""
    indicators = sum(entry.kind == "indicator" for entry in entries)
    entries = tuple(entry for entry in entries if entry.kind != "indicator")
    own = {"numberOfEventIndicators": str(indicators)} if what.exchange else {}
    root = _root(what, "2.0", guid=what.token, **own)
    kind = _child(
        root, what.tag, modelIdentifier=what.identifier,
        canHandleVariableCommunicationStepSize=what.variable_steps, canGetAndSetFMUstate=True,
        canSerializeFMUstate=True, canNotUseMemoryManagementFunctions=True,
        providesDirectionalDerivative=what.slopes,
    )  # fmt: skip
    sources = _child(kind, "SourceFiles")
    for name in what.files:
        _child(sources, "File", name=name)
    _units(root, entries)
    _log(root)
    _experiment(root, what)
    index = {entry.name: i for i, entry in enumerate(entries, start=1)}
    variables = _child(root, "ModelVariables")
    for entry in entries:
        variable = _child(
            variables, "ScalarVariable", name=entry.name, valueReference=entry.reference,
            description=entry.doc or None, causality=entry.causality,
            variability=entry.variability, initial=entry.initial or None,
        )  # fmt: skip
        _child(variable, "Real", **_numbers(entry), derivative=index.get(entry.of))
    structure = _child(root, "ModelStructure")
    known = _known(what, entries)
    for tag, group in (
        ("Outputs", [e for e in entries if e.causality == "output"]),
        ("Derivatives", [e for e in entries if e.kind == "rate"]),
        ("InitialUnknowns", _unknowns(entries)),
    ):
        listed = _child(structure, tag) if group else root
        for entry in group:
            needs = _needs(entry, known, index) if tag == "Outputs" else {}
            _child(listed, "Unknown", index=index[entry.name], **needs)
    return root


def _third(what: Described, entries: tuple[Entry, ...]) -> Xml.Element:
    """FMI 3.0."""
    root = _root(what, "3.0", instantiationToken=what.token)
    _child(
        root, what.tag, modelIdentifier=what.identifier,
        canHandleVariableCommunicationStepSize=what.variable_steps, canGetAndSetFMUState=True,
        canSerializeFMUState=True, fixedInternalStepSize=what.step,
        providesDirectionalDerivatives=what.slopes,
    )  # fmt: skip
    _units(root, entries)
    _log(root)
    _experiment(root, what)
    reference = {entry.name: entry.reference for entry in entries}
    variables = _child(root, "ModelVariables")
    for entry in entries:
        _child(
            variables, "Float64", name=entry.name, valueReference=entry.reference,
            description=entry.doc or None, causality=entry.causality,
            variability=entry.variability, initial=entry.initial or None, **_numbers(entry),
            derivative=reference.get(entry.of),
        )  # fmt: skip
    structure = _child(root, "ModelStructure")
    known = _known(what, entries)
    for entry in entries:
        if entry.causality == "output":
            needs = _needs(entry, known, reference)
            _child(structure, "Output", valueReference=entry.reference, **needs)
    for tag, group in (
        ("ContinuousStateDerivative", [e for e in entries if e.kind == "rate"]),
        ("InitialUnknown", _unknowns(entries)),
        ("EventIndicator", [e for e in entries if e.kind == "indicator"]),
    ):
        for entry in group:
            _child(structure, tag, valueReference=entry.reference)
    return root
