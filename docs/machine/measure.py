"""Measure a subject and store it for the page of benchmarks: `python -m docs.machine.measure ivp`.

What `symfric bench SUBJECT` prints is kept as tables in `docs/benchmarks/SUBJECT.json`, with
machine, load, versions, date and commit; the pages are made of these files alone. Measure on a
machine that does nothing else; what else ran is told by the load, the mean number of processes that
wanted a processor, before and after. `--quick` takes fewer points, and the page says so.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

from docs.machine.pages import DOCS, ROOT
from symfric import bench
from symfric.cli import output
from symfric.cli.bench import SUBJECTS
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
    result = getattr(bench, f"bench_{subject}")(quick=quick)
    loads.append(os.getloadavg()[0])
    spent = perf_counter() - began
    tables = [
        {
            "title": one.title,
            "columns": list(one.head),
            "rows": [[c if isinstance(c, str) else output.number(c) for c in r] for r in one.rows],
        }
        for one in result.shown()
        if not isinstance(one, str) and one.rows
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
