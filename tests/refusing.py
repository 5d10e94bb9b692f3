"""Tables of refused calls: TOML files that map a Python expression to a pattern of its message."""

import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np


def not_refused(table: Path, *packages: ModuleType, **names: Any) -> list[str]:
    """Return the expressions of `table` that raise no ValueError with a matching message.

    They may use the public names of `packages`, `names`, np and ca.
    """
    known: dict[str, Any] = {"np": np, "ca": ca}
    for package in packages:
        known |= {name: getattr(package, name) for name in package.__all__}
    wrong: list[str] = []
    for call, pattern in tomllib.loads(table.read_text(encoding="utf-8")).items():
        try:
            result = eval(call, known | names)
        except ValueError as error:
            if not re.search(pattern, str(error)):
                wrong.append(f"{call}: {error}")
        else:
            wrong.append(f"{call}: gives {result!r}")
    return wrong
