"""Measure a subject and store it for the page of benchmarks: `python -m docs.machine.measure ivp`.

The tables of `symfric bench SUBJECT` are stored in `docs/benchmarks/SUBJECT.json`, with machine,
load, versions, date and commit, and its picture next to it. The page of benchmarks and the tables
of the page on other tools are made from these files only. Measure on an idle machine; the load is
the mean number of processes that waited for a processor, before and after. `--quick` takes fewer
points.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

from docs.machine.markdown import opening, plain, table
from docs.machine.pages import DOCS, ROOT
from symfric import bench
from symfric.bench import SUBJECTS
from symfric.cli import output
from symfric.foundation.files import write_text

STORED = DOCS / "benchmarks"


def machine() -> str:
    """Return processor, system and versions on one line."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    wide = any("avx512f" in line for line in lines if line.startswith("flags"))
    processor = f"{len(models) or '?'} cores of {models[0] if models else platform.processor()}"
    parts = [processor + " with AVX-512" * wide, f"{platform.system()} {platform.machine()}"]
    parts += [f"Python {platform.python_version()}", f"CasADi {version('casadi')}"]
    return ", ".join(parts)


def others() -> list[str]:
    """Return versions of installed tools that subjects compare with."""
    found: list[str] = []
    for name in ("numpy", "scipy", "rockit-meco", "nosnoc", "do-mpc", "opty", "dymos"):
        with suppress(PackageNotFoundError):
            found.append(f"{name} {version(name)}")
    return found


def commit() -> str:
    """Return the measured commit, with a remark if the code was changed since."""
    ask = ["git", "rev-parse", "--short", "HEAD"]
    head = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True)
    ask = ["git", "status", "--porcelain", "symfric", "ocp", "identification"]
    changed = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True)
    return head.stdout.strip() + " with changes" * bool(changed.stdout.strip())


def measured(subject: str, quick: bool) -> dict[str, Any]:
    """Return the tables of `symfric bench SUBJECT` with machine, load and commit."""
    loads, began = [os.getloadavg()[0]], perf_counter()
    result = bench.measure(subject, quick, lambda item, fraction, row: print(row) if row else None)
    loads.append(os.getloadavg()[0])
    if result.draw:
        result.plot(STORED / f"{subject}.png")
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
    """Measure and store subjects; title, description and hand-written summary are kept."""
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


Row = Mapping[str, str]
"""Column title -> cell."""


def stored() -> dict[str, dict[str, Any]]:
    """Return measurements by the name of their file."""
    files = sorted(STORED.glob("*.json"))
    return {path.stem: json.loads(path.read_text("utf-8")) for path in files}


def page() -> str:
    """Return all measurements, each with command, machine, load, date and commit."""
    text = opening("benchmarks")
    for name, found in stored().items():
        text += f"## {found['title']}\n\n" + f"{found['about']}\n\n" * bool(found["about"])
        if short := found.get("short"):
            text += _tables(short) + f"*Summarised by hand from* {made_by(short)}.\n\n"
        if (STORED / f"{name}.png").exists():
            text += f"![{found['title']}]({name}.png)\n\n"
        if "tables" in found:
            text += _tables(found) + f"*Measured by* {made_by(found)}. "
            text += f"Stored in `docs/benchmarks/{name}.json`.\n\n"
    return text


def _tables(found: Mapping[str, Any]) -> str:
    """Return tables with their titles."""
    text = ""
    for one in found["tables"]:
        title = f"**{plain(one['title'].replace('`', ''))}**\n\n" if one["title"] else ""
        text += title
        for names in _pieces(list(one["rows"][0])):
            rows = [[plain(row[name]) for name in names] for row in one["rows"]]
            text += table([plain(name) for name in names], rows)
    return text


def _pieces(names: list[str]) -> list[list[str]]:
    """Return the columns of a table, or of two tables with the same first columns if it is wide."""
    if len(names) <= WIDEST:
        return [names]
    half = len(names) // 2
    return [names[:half], names[:KEPT] + names[half:]]


def made_by(found: Mapping[str, Any]) -> str:
    """Return command, date, commit, machine and load."""
    load = f"; load {found['load']}, {found['seconds']} s" if "load" in found else ""
    parts = f"{found['date']}, commit {found['commit']}; {found['machine']}{load}"
    return f"`{found['command']}`, {plain(parts)}"


WIDEST, KEPT = 13, 2
"""Largest number of columns of a table, and number of those that its second half repeats."""
TOOLS = {"opti": "Opti", "rockit": "rockit", "do_mpc": "do-mpc"}
ROUTES = {"flow": "`flow`", "collocation": "collocation"}


def tables() -> dict[str, str]:
    """Return the tables of the page on other tools: one column for each tool, or for each law."""
    found = stored()["interop"]
    moves, runs = (one["rows"] for one in found["tables"])
    return {
        "interop_moves": _moves(moves),
        "interop_integrators": _integrators(runs),
        "interop_by": f"*Measured by* {made_by(found)}.\n",
    }


def _moves(rows: Sequence[Row]) -> str:
    """Return a row for each law and route, a column for each tool: miss, iterations, time."""
    body: list[list[str]] = []
    for law, route in dict.fromkeys((row["law"], row["route"]) for row in rows):
        own = {r["tool"]: r for r in rows if (r["law"], r["route"]) == (law, route)}
        costs = sorted({r["cost J [N^2 s]"] for r in own.values() if not r["status"]})
        cost = " ... ".join(dict.fromkeys((costs[0], costs[-1]))) if costs else ""
        cells = [_move(own[tool]) if tool in own else "" for tool in TOOLS]
        body.append([f"`{law}`", ROUTES[route], cost, *cells])
    return table(["law", "formulation", "J [N² s]", *TOOLS.values()], body)


def _move(row: Row) -> str:
    """Return miss, iterations and seconds of one tool, or its status."""
    if row["status"] or row["miss [m]"] in ("nan", "-"):
        return row["status"] or "none"
    miss = f"{float(row['miss [m]']):.1e}".replace("e-0", "e-")
    return f"{miss}, {row['iterations']}, {row['processor time [s]']} s"


def _integrators(rows: Sequence[Row]) -> str:
    """Return a row for each of CasADi's integrators, a column for each law: error and time."""
    laws = dict.fromkeys(row["law"] for row in rows)
    body: list[list[str]] = []
    for name in dict.fromkeys(row["integrator"] for row in rows):
        own = {r["law"]: r for r in rows if r["integrator"] == name}
        title = "`simulate`, virtual machine" if name == "symfric" else f"`{name}`"
        body.append([title, *(_integrator(own[law]) for law in laws)])
    return table(["integrator", *(f"`{law}`" for law in laws)], body)


def _integrator(row: Row) -> str:
    """Return error and relative time of an integrator, or that it stops."""
    error, ratio = row["largest error [m]"], row["ratio of time to symfric"]
    if row["status"] or error == "-":
        return "stops" if row["status"] else "not finite"
    return f"{float(error):.0e} m, {float(ratio):.1f} times"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
