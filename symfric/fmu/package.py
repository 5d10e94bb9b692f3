"""Archive of a unit: descriptions, C files and the binary of this platform.

The variables of a unit define modelDescription.xml for both versions of the standard.
"""

import platform
import sys
import tempfile
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree as Xml
from zipfile import ZIP_DEFLATED, ZipFile

from symfric.fmu.equations import UnitEquations
from symfric.fmu.variables import Entry
from symfric.foundation.files import written
from symfric.foundation.programs import CompileError, Compiler, find_compiler
from symfric.foundation.units import CELSIUS, exponents

CATEGORIES = ("logStatusDiscard", "logStatusError")
"""Categories of messages: the unit always reports failures and rejected calls, nothing else."""
INTERVALS = 200
"""Number of communication steps of the default experiment."""


def described(
    own: UnitEquations, identifier: str, token: str, entries: Iterable[Entry], fmi: int
) -> str:
    """Return the text of modelDescription.xml.

    Args:
        own: equations of the unit.
        identifier: C identifier, the name of the binary.
        token: token that links the binary to the description.
        entries: variables; event indicators are omitted in FMI 2.0.
        fmi: version, 2 or 3.
    """
    every = tuple(entries)
    listed = [entry for entry in every if fmi == 3 or entry.kind != "indicator"]
    indicators = sum(entry.kind == "indicator" for entry in every)
    exchange, model, second = own.exchange, own.model.name, fmi == 2
    root = _element(
        None, "fmiModelDescription",
        fmiVersion=f"{fmi}.0",
        modelName=model,
        guid=token if second else None,
        numberOfEventIndicators=indicators if second and exchange else None,
        instantiationToken=None if second else token,
        description=f"{model}: {own.formula} of symfric",
        generationTool=f"symfric {version('symfric')}",
        generationDateAndTime=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        variableNamingConvention="flat",
    )  # fmt: skip
    kind = _element(
        root, "ModelExchange" if exchange else "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize=None if exchange else True,
        **dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate",
                         "canNotUseMemoryManagementFunctions") if second
                        else ("canGetAndSetFMUState", "canSerializeFMUState"), True),
        fixedInternalStepSize=None if second else own.step,
        mightReturnEarlyFromDoStep=True if own.model.events and not (second or exchange) else None,
        **{f"providesDirectionalDerivative{'s' * (not second)}": not own.has_loops},
    )  # fmt: skip
    if second:
        _element(_element(kind, "SourceFiles"), "File", name="all.c")
    _units(root, listed)
    log = _element(root, "LogCategories")
    for category in CATEGORIES:
        _element(log, "Category", name=category)
    begin, end = own.span
    _element(
        root, "DefaultExperiment", startTime=begin, stopTime=end,
        tolerance=own.rtol if own.step is None else None, stepSize=(end - begin) / INTERVALS,
    )  # fmt: skip
    _variables(root, listed, second)
    _structure(root, listed, second, exchange)
    Xml.indent(root)
    text = Xml.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _element(parent: Xml.Element | None, tag: str, **attributes: object) -> Xml.Element:
    """Return a new element below `parent`; attributes that are None are omitted."""
    element = Xml.Element(tag, _texts(attributes))
    if parent is not None:
        parent.append(element)
    return element


def _texts(attributes: Mapping[str, object]) -> dict[str, str]:
    def text(value: object) -> str:
        if isinstance(value, bool):
            return "true" if value else "false"
        return repr(value) if isinstance(value, float) else str(value)

    return {name: text(value) for name, value in attributes.items() if value is not None}


def _units(root: Xml.Element, entries: Iterable[Entry]) -> None:
    """Add each unit once, with its exponents if it is a product of SI units."""
    used = dict.fromkeys(entry.unit for entry in entries if entry.unit not in ("", "1"))
    group = _element(root, "UnitDefinitions") if used else root
    for text in used:
        unit = _element(group, "Unit", name=text)
        base = {"K": 1} if text == CELSIUS else exponents(text)
        if base is not None:
            _element(unit, "BaseUnit", **base, offset=273.15 if text == CELSIUS else None)


def _numbers(entries: Iterable[Entry], second: bool) -> dict[str, int]:
    """Return the number that refers to each variable: its index in FMI 2.0, else its reference."""
    numbered = enumerate(entries, start=1)
    return {entry.name: place if second else entry.reference for place, entry in numbered}


def _variables(root: Xml.Element, entries: Iterable[Entry], second: bool) -> None:
    number, group = _numbers(entries, second), _element(root, "ModelVariables")
    for entry in entries:
        variable = _element(
            group, "ScalarVariable" if second else "Float64", name=entry.name,
            valueReference=entry.reference, description=entry.doc or None,
            causality=entry.causality, variability=entry.variability,
            initial=entry.initial or None,
        )  # fmt: skip
        values: dict[str, object] = {
            "unit": entry.unit if entry.unit not in ("", "1") else None,
            "nominal": entry.nominal,
            "min": entry.lower if isfinite(entry.lower) else None,
            "max": entry.upper if isfinite(entry.upper) else None,
            "start": entry.start,
            "derivative": number.get(entry.of),
        }
        real = _element(variable, "Real") if second else variable
        real.attrib |= _texts(values)


def _structure(root: Xml.Element, entries: Iterable[Entry], second: bool, exchange: bool) -> None:
    """Add outputs with their dependencies, rates, initial unknowns and event indicators.

    Outputs depend on inputs and states. Initial unknowns are outputs and states that are not set,
    and rates.
    """
    number, group = _numbers(entries, second), _element(root, "ModelStructure")
    kinds = ("state",) if exchange else ()
    known = {e.name for e in entries if e.causality == "input" or e.kind in kinds}
    outputs = [e for e in entries if e.causality == "output"]
    rates = [e for e in entries if e.kind == "rate"]
    unknowns = [
        e
        for e in entries
        if e.initial in ("approx", "calculated") and (e.causality == "output" or e.kind == "rate")
    ]
    for tag, inner, listed in (
        ("Outputs", "Output", outputs),
        ("Derivatives", "ContinuousStateDerivative", rates),
        ("InitialUnknowns", "InitialUnknown", unknowns),
        ("", "EventIndicator", [e for e in entries if e.kind == "indicator"]),
    ):
        parent = _element(group, tag) if second and listed else group
        for entry in listed:
            needs = sorted(number[name] for name in entry.needs if name in known)
            depends = " ".join(map(str, needs)) if listed is outputs else None
            place = {"index" if second else "valueReference": number[entry.name]}
            _element(parent, "Unknown" if second else inner, **place, dependencies=depends)


SOURCES = Path(__file__).with_name("sources")
FLAGS = (
    "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared",
    "-Werror=implicit-function-declaration",
)  # fmt: skip
"""Flags of the compiler; without fused multiply-add, steps have the same bits as `simulate`."""
MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
SYSTEMS = {"Linux": "linux", "Darwin": "darwin", "Windows": "windows"}
OLD = {
    "x86_64-linux": "linux64", "x86-linux": "linux32", "x86_64-windows": "win64",
    "x86-windows": "win32", "x86_64-darwin": "darwin64",
}  # fmt: skip
"""Names of platforms in version 2.0; other platforms have the same name in both versions."""
ENDINGS = {"Windows": ".dll", "Darwin": ".dylib"}


def platform_name(fmi: int) -> str:
    """Return the name of this platform in the standard."""
    machine = platform.machine().lower()
    system = SYSTEMS.get(platform.system(), platform.system().lower())
    name = f"{MACHINES.get(machine, machine)}-{system}"
    return OLD.get(name, name) if fmi == 2 else name


def shared_name(identifier: str) -> str:
    """Return the file name of a binary on this platform."""
    return identifier + ENDINGS.get(platform.system(), ".so")


def fixed_text(name: str) -> str:
    """Return the text of a C file that all units share."""
    return (SOURCES / name).read_text(encoding="utf-8")


def sources(own: UnitEquations, sizes: str, model: str, fmi: int) -> dict[str, str]:
    """Return the texts of the C files of a unit, by name; `all.c` includes the others.

    Args:
        sizes, model: C of the model.
        fmi: version, 2 or 3.
    """
    kinds = ("exchange", "cosimulation") if own.exchange else ("cosimulation", "exchange")
    steps, calls = "adaptive.c", "communication.c"
    if own.exchange:
        steps, calls = "exchange.c", "rates.c"
    elif own.step is not None:
        steps = "fixed.c"
    shared = ["consistent.c", steps, "unit.c", calls, "derivatives.c", "states.c"]
    interface = [f"fmi{fmi}.c", f"fmi{fmi}_{kinds[0]}.c"]
    interface += ["fmi3_absent.c", f"fmi3_no_{kinds[1]}.c"] * (fmi == 3)
    fixed = ("memory.h", "numbers.c", *shared, f"fmi{fmi}.h", *interface)
    texts = {"sizes.h": sizes, "model.c": model} | {name: fixed_text(name) for name in fixed}
    local = [f"fmi{fmi}.h", "sizes.h", "memory.h", "numbers.c", "model.c", *shared, *interface]
    system = ("float.h", "math.h", "stdbool.h", "stdio.h", "stdlib.h", "string.h")
    includes = "".join(f"#include <{name}>\n" for name in system)
    includes += "\n" + "".join(f'#include "{name}"\n' for name in local)
    return texts | {"all.c": f"/* The whole unit: the one file to compile. */\n\n{includes}"}


def compiled(texts: Mapping[str, str], target: str) -> tuple[bytes, str]:
    """Return the binary for this platform and "", or no bytes and the reason.

    Raises:
        CompileError: the compiler rejects the C.
    """
    compiler = find_compiler()
    if sys.platform == "win32":
        return b"", "units are compiled on Linux and macOS; compile sources/all.c"
    if compiler is None:
        return b"", "no C compiler ($CC, gcc, clang or cc) was found"
    with tempfile.TemporaryDirectory(prefix="symfric-fmu-") as folder:
        place = Path(folder)
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
        compile_unit(compiler, place, place / target)
        return (place / target).read_bytes(), ""


def compile_unit(compiler: Compiler, folder: Path, target: Path, *more: str) -> list[str]:
    """Compile `all.c` in `folder` to a library; return the warnings.

    Raises:
        CompileError: the compiler rejects the C.
    """
    warned = compiler.warnings(*FLAGS, *more, str(folder / "all.c"), "-o", str(target), "-lm")
    if not target.exists():
        raise CompileError(f"{compiler} wrote nothing")
    return warned


def packed(path: Path, files: Mapping[str, str | bytes]) -> int:
    """Write the archive atomically; return its size in bytes."""
    with written(path) as temporary:
        with ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
            for name, content in files.items():
                archive.writestr(name, content)
        return temporary.stat().st_size
