"""Archive of a unit: its descriptions, its C, and the binary of this platform.

modelDescription.xml of both versions of the standard comes from the variables of a unit.
"""

import platform
import sys
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import final
from xml.etree import ElementTree as Xml
from zipfile import ZIP_DEFLATED, ZipFile

from symfric.fmu.variables import Entry
from symfric.foundation.files import written
from symfric.foundation.programs import CompileError, Compiler, find_compiler
from symfric.foundation.units import CELSIUS, exponents

CATEGORIES = ("logStatusDiscard", "logStatusError")
"""Messages come in any case: there are none but of what failed or was refused."""


@final
@dataclass(frozen=True, eq=False)
class Described:
    """Content of modelDescription.xml besides the variables.

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
        """Name of its kind in the standard."""
        return "ModelExchange" if self.exchange else "CoSimulation"

    @property
    def variable_steps(self) -> bool | None:
        """True if communication steps may have any length; None if there are none."""
        return None if self.exchange else True


def described(what: Described, entries: Iterable[Entry], fmi: int) -> str:
    """Return the text of modelDescription.xml; `fmi` is 2 or 3."""
    root = (_second if fmi == 2 else _third)(what, tuple(entries))
    Xml.indent(root)
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def build_description(what: Described) -> str:
    """buildDescription.xml with the sources, of 3.0."""
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
    """Return a new element; attributes that are None are left out."""
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
    """Unknowns at the start: outputs and states that are not set, and rates."""
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


SOURCES = Path(__file__).with_name("sources")
FLAGS = (
    "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared",
    "-Werror=implicit-function-declaration",
)  # fmt: skip
"""Without contraction to fused multiply-add the steps have the bits of `simulate`."""
MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
SYSTEMS = {"Linux": "linux", "Darwin": "darwin", "Windows": "windows"}
OLD = {
    "x86_64-linux": "linux64", "x86-linux": "linux32", "x86_64-windows": "win64",
    "x86-windows": "win32", "x86_64-darwin": "darwin64",
}  # fmt: skip
"""What version 2.0 calls a platform; one that it does not know keeps its name of 3.0."""
ENDINGS = {"windows": ".dll", "darwin": ".dylib"}


def platform_name(fmi: int) -> str:
    """Name of this platform in the standard."""
    machine = platform.machine().lower()
    system = SYSTEMS.get(platform.system(), platform.system().lower())
    name = f"{MACHINES.get(machine, machine)}-{system}"
    return OLD.get(name, name) if fmi == 2 else name


def shared_name(identifier: str) -> str:
    """File name of a binary here."""
    system = SYSTEMS.get(platform.system(), "")
    return identifier + ENDINGS.get(system, ".so")


def fixed_text(name: str) -> str:
    """One of the C files that all units share."""
    return (SOURCES / name).read_text(encoding="utf-8")


def sources(sizes: str, model: str, fmi: int, fixed: bool, exchange: bool) -> dict[str, str]:
    """Name -> text of the C of a unit; `all.c` includes the others.

    Args:
        sizes, model: C of the model.
        fmi: version, 2 or 3.
        fixed: whether its steps are.
        exchange: whether it is for model exchange, and makes no steps.
    """
    steps = "exchange.c" if exchange else "fixed.c" if fixed else "adaptive.c"
    shared = ["consistent.c", steps, "unit.c", "rates.c" if exchange else "communication.c"]
    shared += ["derivatives.c", "states.c"]
    kinds = ("exchange", "cosimulation") if exchange else ("cosimulation", "exchange")
    own = [f"fmi{fmi}.c", f"fmi{fmi}_{kinds[0]}.c"]
    own += ["fmi3_absent.c", f"fmi3_no_{kinds[1]}.c"] if fmi == 3 else []
    texts = {"sizes.h": sizes, "model.c": model}
    fixed_files = ("memory.h", "numbers.c", *shared, f"fmi{fmi}.h", *own)
    texts |= {name: fixed_text(name) for name in fixed_files}
    included = [f"fmi{fmi}.h", "sizes.h", "memory.h", "numbers.c", "model.c", *shared, *own]
    system = ("float.h", "math.h", "stdbool.h", "stdio.h", "stdlib.h", "string.h")
    texts["all.c"] = (
        "/* The whole unit: the one file to compile. */\n\n"
        + "".join(f"#include <{name}>\n" for name in system)
        + "\n"
        + "".join(f'#include "{name}"\n' for name in included)
    )
    return texts


@final
@dataclass(frozen=True, eq=False)
class Binary:
    """Library of this platform, or why there is none."""

    name: str
    content: bytes
    missing: str = ""


def compiled(texts: Mapping[str, str], identifier: str, fmi: int) -> Binary:
    """Compile the unit for this platform; without a compiler the sources alone are handed out.

    Raises:
        CompileError: the compiler refuses the C.
    """
    compiler = find_compiler()
    name = f"binaries/{platform_name(fmi)}/{shared_name(identifier)}"
    if sys.platform == "win32":
        return Binary(name, b"", "units are compiled on Linux and macOS; compile sources/all.c")
    if compiler is None:
        return Binary(name, b"", "no C compiler ($CC, gcc, clang or cc) was found")
    with tempfile.TemporaryDirectory(prefix="symfric-fmu-") as folder:
        place = Path(folder)
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
        target = place / shared_name(identifier)
        compile_unit(compiler, place, target)
        return Binary(name, target.read_bytes())


def compile_unit(compiler: Compiler, folder: Path, target: Path, *more: str) -> list[str]:
    """Compile `all.c` in `folder` to a library; returns the warnings.

    Raises:
        CompileError: the compiler refuses it.
    """
    warned = compiler.warnings(*FLAGS, *more, str(folder / "all.c"), "-o", str(target), "-lm")
    if not target.exists():
        raise CompileError(f"{compiler} wrote nothing")
    return warned


def packed(
    path: Path, description: str, build: str, texts: Mapping[str, str], binary: Binary
) -> int:
    """Write the archive, whole or not at all; returns its size in bytes."""
    with written(path) as temporary:
        with ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description)
            for name, text in texts.items():
                archive.writestr(f"sources/{name}", text)
            if build:
                archive.writestr("sources/buildDescription.xml", build)
            if binary.content:
                archive.writestr(binary.name, binary.content)
        return temporary.stat().st_size
