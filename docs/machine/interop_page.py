"""Tables of the page on other tools, from `docs/benchmarks/interop.json` alone.

The measurement has a line for each tool, route and law; here tools stand side by side.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from docs.machine import rst
from docs.machine.bench_pages import made_by, stored
from docs.machine.drawing import MADE

FOLDER = MADE / "tables"
Row = Mapping[str, str]
"""Column -> cell."""
TOOLS = {"opti": "Opti", "rockit": "rockit", "do_mpc": "do-mpc"}
ROUTES = {"flow": "``flow``", "colloca": "collocation"}


def tables() -> dict[str, str]:
    """Name of each table -> its text."""
    found = stored()["interop"]
    by_first = {one["columns"][0]: rows(one) for one in found["tables"]}
    return {
        "interop_moves": moves(by_first["tool"]),
        "interop_integrators": integrators(by_first["integrator"]),
        "interop_by": f"*Measured by* {made_by(found)}.\n",
    }


def rows(one: Mapping[str, Any]) -> list[Row]:
    """The rows of a stored table by the names of its columns."""
    return [dict(zip(one["columns"], row, strict=True)) for row in one["rows"]]


def moves(lines: Sequence[Row]) -> str:
    """A row for each law and route, a column for each tool: miss, iterations, time."""
    head = ["law", "in as", "J [N² s]", *TOOLS.values()]
    keys = dict.fromkeys((line["law"], line["route"]) for line in lines)
    body: list[list[str]] = []
    for law, route in keys:
        own = {m["tool"]: m for m in lines if (m["law"], m["route"]) == (law, route)}
        costs = sorted({m["J"] for m in own.values() if not m[""]})
        cost = " ... ".join(dict.fromkeys((costs[0], costs[-1]))) if costs else ""
        cells = [cell(own[tool]) if tool in own else "" for tool in TOOLS]
        body.append([f":doc:`{law} </laws/{law}>`", ROUTES[route], cost, *cells])
    return rst.table(head, body)


def cell(line: Row) -> str:
    """What one tool made of the move: its miss, iterations and seconds, or why it ended."""
    if line[""] or line["miss"] in ("nan", "-"):
        return rst.plain(line[""] or "none")
    miss = f"{float(line['miss']):.1e}".replace("e-0", "e-")
    return rst.plain(f"{miss}, {line['it.']}, {line['s']} s")


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
    """How far an integrator is off and how long it takes, or that it stops."""
    if line[""]:
        return "stops"
    if line["error [m]"] == "-":
        return "not finite"
    return rst.plain(f"{float(line['error [m]']):.0e} m, {float(line['time ratio']):.1f} times")


def write() -> None:
    """Write the tables where the page includes them; one that is as it was is left alone."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in tables().items():
        path = FOLDER / f"{name}.rst"
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")
