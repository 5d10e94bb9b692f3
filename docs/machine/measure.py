"""Measure a subject and store it for the page of benchmarks: `python -m docs.machine.measure ivp`.

The page itself is made here, too, from the stored measurements alone. The page on other tools takes
its tables from there: the measurement has a line for each tool, route and law; there tools stand
side by side.

What `symfric bench SUBJECT` prints is kept as tables in `docs/benchmarks/SUBJECT.json`, with
machine, load, versions, date and commit; the pages are made of these files alone. Measure on a
machine that does nothing else; the load shows what else ran, the mean number of processes that
wanted a processor, before and after. `--quick` takes fewer points, and the page says so.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

from docs.machine import rst
from docs.machine.made import MADE
from docs.machine.pages import DOCS, ROOT
from docs.machine.rst import sentence
from symfric import bench
from symfric.bench import SUBJECTS
from symfric.cli import output
from symfric.foundation.files import write_text

STORED = DOCS / "benchmarks"


def machine() -> str:
    """The processor and what runs on it, in one line."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    wide = any("avx512f" in line for line in lines if line.startswith("flags"))
    processor = f"{len(models) or '?'} cores of {models[0] if models else platform.processor()}"
    parts = [processor + " with AVX-512" * wide, f"{platform.system()} {platform.machine()}"]
    parts += [f"Python {platform.python_version()}", f"CasADi {version('casadi')}"]
    return ", ".join(parts)


def others() -> list[str]:
    """Versions of what subjects compare with, where it is installed."""
    found: list[str] = []
    for name in ("numpy", "scipy", "rockit-meco", "do-mpc", "exudyn"):
        with suppress(PackageNotFoundError):
            found.append(f"{name} {version(name)}")
    return found


def commit() -> str:
    """The commit that is measured; says so where the code was changed since."""
    ask = ["git", "rev-parse", "--short", "HEAD"]
    head = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True)
    ask = ["git", "status", "--porcelain", "symfric", "ocp", "identification"]
    changed = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True)
    return head.stdout.strip() + " with changes" * bool(changed.stdout.strip())


def measured(subject: str, quick: bool) -> dict[str, Any]:
    """The tables that `symfric bench SUBJECT` prints, with what they were measured on."""
    loads, began = [os.getloadavg()[0]], perf_counter()
    result = bench.measure(subject, quick)
    loads.append(os.getloadavg()[0])
    spent = perf_counter() - began
    tables = [
        {
            "title": one.title,
            "rows": [dict(zip(one.head, map(shown_cell, r), strict=True)) for r in one.rows],
        }
        for one in result.shown()
        if not isinstance(one, str)
    ]
    return {
        "title": subject.capitalize(),
        "about": "",
        "command": f"symfric bench {subject}{' --quick' * quick}",
        "date": date.today().isoformat(),
        "commit": commit(),
        "machine": ", ".join([machine(), *others()]),
        "load": " to ".join(f"{load:.1f}" for load in loads),
        "seconds": round(spent),
        "tables": tables,
    }


def shown_cell(cell: str | float) -> str:
    """Return a cell as the command prints it."""
    return cell if isinstance(cell, str) else output.number(cell)


def main(arguments: Sequence[str]) -> int:
    """Measure what is named and store it; title, words and what was condensed by hand stay."""
    quick, subjects = "--quick" in arguments, [a for a in arguments if a != "--quick"]
    unknown = [subject for subject in subjects if subject not in SUBJECTS]
    if unknown or not subjects:
        print(f"measure: expected some of {', '.join(SUBJECTS)}, got {' '.join(unknown) or 'none'}")
        return 2
    for subject in subjects:
        path = STORED / f"{subject}.json"
        found = measured(subject, quick)
        before = json.loads(path.read_text("utf-8")) if path.exists() else {}
        found |= {key: before[key] for key in ("title", "about", "short") if key in before}
        write_text(path, json.dumps(found, indent=1, ensure_ascii=False) + "\n")
        print(f"wrote {path} after {found['seconds']} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))


KEYS = ("title", "about", "command", "date", "commit", "machine", "load", "seconds", "tables")
"""What `docs.machine.measure` writes; "short", a hand-written summary, may be added."""
SHORT = ("command", "date", "commit", "machine", "tables")
"""What stands under "short": tables that people made of a longer measurement."""


def stored() -> dict[str, dict[str, Any]]:
    """File name -> measurement."""
    files = sorted(STORED.glob("*.json"))
    return {path.stem: json.loads(path.read_text("utf-8")) for path in files}


def page() -> str:
    """All measurements, each with command, machine, load, date and commit."""
    text = rst.title("Benchmarks")
    text += (
        "Measured numbers, kept as files next to this page with command, machine, load, date and "
        "commit. Times are processor times of whole calls from Python unless a table says "
        "otherwise. ``symfric bench SUBJECT`` measures on your machine; ``python -m "
        "docs.machine.measure SUBJECT`` stores what it finds for this page.\n\n"
        "*Load* is the mean number of processes that wanted a processor before and after, of which "
        "the machine has two. Above two, times are too long, and their ratios are off, too; counts "
        "and errors are not touched by it.\n\n"
    )
    return text + "".join(section(name, found) for name, found in stored().items())


def section(name: str, found: Mapping[str, Any]) -> str:
    """One measurement: what people condensed of a long one, then the tables as measured."""
    text = rst.title(found["title"], "-")
    if found["about"]:
        text += sentence(found["about"]) + "\n\n"
    short = found.get("short")
    if short:
        text += "".join(shown(short["tables"]))
        text += f"*Condensed by hand from* {made_by(short)}.\n\n"
    if "tables" in found:
        text += "".join(shown(found["tables"]))
        text += f"*Measured by* {made_by(found)}. Stored in ``docs/benchmarks/{name}.json``.\n\n"
    return text


def shown(tables: Iterable[Mapping[str, Any]]) -> Iterable[str]:
    """Tables with their titles."""
    for one in tables:
        if one["title"]:
            yield f"**{rst.plain(one['title'].replace('`', ''))}**\n\n"
        rows = [[sentence(cell) for cell in row.values()] for row in one["rows"]]
        yield rst.table([sentence(c) for c in one["rows"][0]], rows)


def made_by(found: Mapping[str, Any]) -> str:
    """Command, date, commit, machine and load."""
    load = f"; load {found['load']}, {found['seconds']} s" if "load" in found else ""
    parts = f"{found['date']}, commit {found['commit']}; {found['machine']}{load}"
    return f"``{found['command']}``, {rst.plain(parts)}"


FOLDER = MADE / "tables"
Row = Mapping[str, str]
"""Column -> cell."""
TOOLS = {"opti": "Opti", "rockit": "rockit", "do_mpc": "do-mpc"}
ROUTES = {"flow": "``flow``", "collocation": "collocation"}


def tables() -> dict[str, str]:
    """Name of each table -> its text."""
    found = stored()["interop"]
    by_first = {next(iter(one["rows"][0])): one["rows"] for one in found["tables"]}
    return {
        "interop_moves": moves(by_first["tool"]),
        "interop_integrators": integrators(by_first["integrator"]),
        "interop_by": f"*Measured by* {made_by(found)}.\n",
    }


def moves(lines: Sequence[Row]) -> str:
    """A row for each law and route, a column for each tool: miss, iterations, time."""
    head = ["law", "in as", "J [N² s]", *TOOLS.values()]
    keys = dict.fromkeys((line["law"], line["route"]) for line in lines)
    body: list[list[str]] = []
    for law, route in keys:
        own = {m["tool"]: m for m in lines if (m["law"], m["route"]) == (law, route)}
        costs = sorted({m["cost J [N^2 s]"] for m in own.values() if not m["status"]})
        cost = " ... ".join(dict.fromkeys((costs[0], costs[-1]))) if costs else ""
        cells = [cell(own[tool]) if tool in own else "" for tool in TOOLS]
        body.append([f":doc:`{law} </laws/{law}>`", ROUTES[route], cost, *cells])
    return rst.table(head, body)


def cell(line: Row) -> str:
    """Miss, iterations and seconds of one tool in the move, or the reason why it ended."""
    if line["status"] or line["miss [m]"] in ("nan", "-"):
        return rst.plain(line["status"] or "none")
    miss = f"{float(line['miss [m]']):.1e}".replace("e-0", "e-")
    return rst.plain(f"{miss}, {line['iterations']}, {line['processor time [s]']} s")


def integrators(lines: Sequence[Row]) -> str:
    """A row for each of CasADi's integrators, a column for each law: error and time."""
    laws = dict.fromkeys(line["law"] for line in lines)
    body: list[list[str]] = []
    for name in dict.fromkeys(line["integrator"] for line in lines):
        own = {m["law"]: m for m in lines if m["integrator"] == name}
        cells = [off(own[law]) for law in laws]
        shown = "``simulate``, virtual machine" if name == "symfric" else f"``{name}``"
        body.append([shown, *cells])
    return rst.table(["", *(f":doc:`{law} </laws/{law}>`" for law in laws)], body)


def off(line: Row) -> str:
    """Error and time of an integrator, or that it stops."""
    if line["status"]:
        return "stops"
    if line["largest error [m]"] == "-":
        return "not finite"
    error, ratio = line["largest error [m]"], line["ratio of time to symfric"]
    return rst.plain(f"{float(error):.0e} m, {float(ratio):.1f} times")


def write_interop() -> None:
    """Write the tables where the page includes them; one that is as it was is left alone."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in tables().items():
        path = FOLDER / f"{name}.rst"
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")
