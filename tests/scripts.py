"""JavaScript functions evaluated in headless Chromium."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec

import casadi as ca
import numpy as np
import pytest

from docs.machine.browser import NAMES, listened
from symfric.emitter.javascript import LIBRARY, script

needs_browser = pytest.mark.skipif(
    find_spec("playwright") is None or not any(map(shutil.which, NAMES)),
    reason=f"needs Playwright (extra docs) and one of {', '.join(NAMES)}",
)
CALLS = "rows => rows.map(row => f(...row))"


@contextmanager
def opened() -> Iterator:
    """Yield an empty page; its script must cause no errors and no requests."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    program = next(found for name in NAMES if (found := shutil.which(name)))
    with sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=program).new_page()
        errors = listened(page)
        yield page
        assert errors == []


def evaluated(page, function: ca.Function, rows: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """Results of the JavaScript of a function, one row for each list of arguments."""
    page.evaluate(f"() => {{ {LIBRARY}\n{script(function, 'f')}\nwindow.f = f; }}")
    given = [[np.ravel(argument).tolist() for argument in row] for row in rows]
    return np.array(page.evaluate(CALLS, given), float).reshape(len(rows), -1)


def in_python(function: ca.Function, rows: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """The same results by CasADi."""
    return np.array([ca.veccat(*function.call(list(row))).full().ravel() for row in rows])


def misses(found: np.ndarray, expected: np.ndarray, rtol: float) -> np.ndarray:
    """Mask of the numbers that differ; NaN equals NaN."""
    with np.errstate(invalid="ignore"):
        near = np.abs(found - expected) <= rtol * np.abs(expected)
    return ~(near | (found == expected) | (np.isnan(found) & np.isnan(expected)))
