"""Run time against error of methods: closed forms, counts, order of calls, output."""

import csv
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from tables import sampled

from symfric import (
    LuGre,
    Model,
    Variable,
    WorkPoint,
    WorkPrecision,
    rabinowicz,
    simulate,
    work_precision,
)  # fmt: skip

T_END, RTOLS = 3.0, (1e-5, 1e-7, 1e-9)


def oscillator(rate: float) -> Model:
    """Return x'' = -rate^2 x from x = 1, whose solution is cos(rate t)."""
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s", nominal=rate)
    return Model("oscillator", x=(x, v), ode=ca.vertcat(v.symbol, -(rate**2) * x.symbol))


@pytest.mark.parametrize("rate", sampled([40.0, 1.0], of=2))
def test_errors_are_those_from_the_closed_form(rate: float) -> None:
    model = oscillator(rate)
    methods = ("rodas5p", "rodas4p", "radau5", "dopri5")
    found = work_precision(model, T_END, methods=methods, rtols=RTOLS, rounds=1, backend="vm")
    for point in found.points:
        run = simulate(model, T_END, rtol=point.rtol, method=point.method, samples=401)
        x, v = np.cos(rate * run.t), -rate * np.sin(rate * run.t)
        pairs = ((run["x"], x), (run["v"], v))
        error = max(np.abs(one - exact).max() / np.abs(exact).max() for one, exact in pairs)
        assert point.resolved
        assert 0.5 < point.error / error < 1.5, (point, error)
        assert point.steps == run.statistics.steps
        assert point.evaluations == run.statistics.evaluations
    assert [(p.method, p.rtol) for p in found.points] == [(m, r) for m in methods for r in RTOLS]


def test_calls_alternate_between_all_points_with_one_engine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From loose to tight, whatever the order of the given tolerances."""
    calls = list[tuple[str, float, str]]()

    def recorded(*args: Any, **more: Any) -> Any:
        calls.append((more["method"], more["rtol"], more["backend"]))
        return simulate(*args, **more)

    monkeypatch.setattr(sys.modules[work_precision.__module__], "simulate", recorded)
    done = list[float]()
    found = work_precision(
        rabinowicz(LuGre()), 0.5, methods=("auto", "dopri5"), rtols=(1e-7, 1e-5, 1e-7), rounds=3,
        backend="vm", signals=("x",), progress=done.append,
    )  # fmt: skip
    points = [(m, r, "vm") for m in ("auto", "dopri5") for r in (1e-5, 1e-7)]
    assert calls[2:] == [*points, *(point for _ in range(3) for point in points for _ in range(2))]
    assert calls[:2] == [(method, 1e-7 / 100, "vm") for method in ("radau5", "rodas5p")]
    assert done == [1 / 3, 2 / 3, 1.0]
    assert (found.engine, found.signals, found.methods) == ("vm", ("x",), ("auto", "dopri5"))
    assert all(row["engine"] == "vm" for row in found.table)


def test_a_method_that_cannot_integrate_the_model_is_listed() -> None:
    x, z = Variable("x", "m", start=1.0), Variable("z", "m")
    alg = z.symbol + 0.1 * z.symbol**3 - x.symbol
    model = Model("implicit", x=(x,), z=(z,), ode=-z.symbol, alg=alg)
    found = work_precision(model, 1.0, methods=("dopri5", "rodas4p"), rtols=(1e-4,), backend="vm")
    assert found.methods == ("rodas4p",)
    assert "expected an ODE" in found.failed["dopri5 at 1e-04"]
    assert "dopri5 at 1e-04: method DOPRI5" in repr(found)


def test_an_interrupt_ends_the_comparison(monkeypatch: pytest.MonkeyPatch) -> None:
    """The time of an interrupted run is not the time of a point."""

    def stop(_: float) -> None:
        raise KeyboardInterrupt

    def interrupted(*args: Any, **more: Any) -> Any:
        return simulate(*args, **more | {"progress": stop})

    monkeypatch.setattr(sys.modules[work_precision.__module__], "simulate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        work_precision(rabinowicz(LuGre()), 20.0, rtols=(1e-6,), backend="vm")


def made(*rows: tuple[str, float, float, bool]) -> WorkPrecision:
    """Return a result with points (method, error, time [s], resolved)."""
    points = (WorkPoint(name, 1e-6, e, t, 1, 0, 8, 1, good) for name, e, t, good in rows)
    return WorkPrecision(
        "machine", (0.0, 2.0), "compiled", ("x",), 401, 5, "Radau5 at rtol 1e-11", 1e-11,
        tuple(points), {},
    )  # fmt: skip


def test_times_at_equal_error_use_resolved_points_only() -> None:
    found = made(
        ("a", 1e-3, 1e-3, True), ("a", 1e-5, 1e-2, True), ("a", 1e-11, 1.0, False),
        ("b", 1e-4, 5e-3, True), ("b", 1e-6, 4e-3, True),
    )  # fmt: skip
    assert found.time_at("a", 1e-4) == pytest.approx(10**-2.5)
    assert found.time_at("a", 1e-2) == 1e-3
    assert found.time_at("a", 1e-9) != found.time_at("a", 1e-9)  # NaN
    assert found.time_at("b", 1e-4) == 4e-3, "a slower point with a larger error is not used"
    with pytest.raises(ValueError, match="expected one of a, b, got c"):
        found.time_at("c", 1e-4)
    with pytest.raises(ValueError, match="error: expected a number > 0, got 'a'"):
        found.time_at("a", "a")  # pyright: ignore[reportArgumentType]
    text = repr(found).splitlines()
    assert text[0] == "work and precision of 'machine' from 0 to 2 s, compiled"
    hidden = "1 of 5 points are not shown: their error is below 3 times that of the reference"
    assert text.pop() == hidden
    assert [line.split() for line in text[4:]] == [
        ["error", "a", "[ms]", "b", "[ms]"], ["1e-03", "1", "4"], ["1e-04", "3.16", "4"],
        ["1e-05", "10", "4"], ["1e-06", "-", "4"],
    ]  # fmt: skip


def test_plot_and_csv_contain_the_points(tmp_path: Path) -> None:
    found = made(
        ("a", 1e-9, 1e-3, True), ("a", 2e-12, 1e-2, False), ("b", 1e-8, 2e-3, True)
    )  # fmt: skip
    axis = found.plot(tmp_path / "curves.png").axes[0]
    lines = {str(line.get_label()): np.array(line.get_xydata()) for line in axis.get_lines()}
    assert lines["a"] == pytest.approx(np.array([[1e-9, 1.0]]))
    assert lines["b"] == pytest.approx(np.array([[1e-8, 2.0]]))
    assert axis.xaxis_inverted()
    assert axis.get_ylabel() == "processor time [ms], compiled"
    assert (tmp_path / "curves.png").stat().st_size > 1000
    found.to_csv(tmp_path / "points.csv")
    rows = [*csv.DictReader((tmp_path / "points.csv").read_text("utf-8").splitlines())]
    assert [(r["engine"], r["method"], float(r["error"]), r["resolved"]) for r in rows] == [
        ("compiled", "a", 1e-9, "True"), ("compiled", "a", 2e-12, "False"),
        ("compiled", "b", 1e-8, "True"),
    ]  # fmt: skip
    assert repr(made()).splitlines()[-1].split() == ["error"], "a result without points"
