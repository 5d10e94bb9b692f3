"""Measure a subject and store it for the page of benchmarks: `python -m docs.machine.measure ivp`.

What `symfric bench SUBJECT` prints is kept as tables in `docs/benchmarks/SUBJECT.json`, with
machine, versions, date and commit; the page is made of these files alone. Measure on a machine that
does nothing else; `--quick` takes fewer points, and the page says so.
"""

import json
import platform
import subprocess
import sys
from collections.abc import Iterable, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

from docs.machine.pages import DOCS, ROOT
from symfric import bench
from symfric.cli import bench_tables, output
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


def measured(subject: str, quick: bool) -> dict[str, Any]:
    """The tables that `symfric bench SUBJECT` prints, with what they were measured on."""
    tables: list[dict[str, Any]] = []

    def keep(columns: Sequence[str], rows: Iterable[Sequence[Any]], title: str = "") -> None:
        shown = [[c if isinstance(c, str) else output.number(c) for c in row] for row in rows]
        if shown:
            tables.append({"title": title, "columns": list(columns), "rows": shown})

    result = getattr(bench, f"bench_{subject}")(quick=quick)
    printed, output.show_table = output.show_table, keep
    try:
        getattr(bench_tables, subject)(result)
    finally:
        output.show_table = printed
    ask = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=True)
    return {
        "title": subject.capitalize(),
        "about": "",
        "command": f"symfric bench {subject}{' --quick' * quick}",
        "date": date.today().isoformat(),
        "commit": commit.stdout.strip(),
        "machine": machine(),
        "tables": tables,
    }


def main(arguments: Sequence[str]) -> int:
    """Measure what is named and store it; title and words that are there stay."""
    quick, subjects = "--quick" in arguments, [a for a in arguments if a != "--quick"]
    for subject in subjects:
        path = STORED / f"{subject}.json"
        found = measured(subject, quick)
        if path.exists():
            before = json.loads(path.read_text("utf-8"))
            found |= {"title": before["title"], "about": before["about"]}
        write_text(path, json.dumps(found, indent=1, ensure_ascii=False) + "\n")
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
