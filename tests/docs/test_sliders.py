"""Curves of the laws' pages: JavaScript has Python's numbers, and sliders move the curves."""

import json
import re
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from scripts import evaluated, in_python, misses, needs_browser, opened

from docs.machine import sliders
from docs.machine.sliders import MOST, SHARED, SMALL, slider, steady, written
from symfric import ALL_LAWS, LuGre, Variable, parameters, simulate
from symfric.codegen import plant_block
from symfric.figures.motion import NORMAL_FORCE
from symfric.laws import steady_force
from symfric.scenes import Rabinowicz

DIVERSE = (
    "armstrong",
    "lugre",
    "quarter_car_general",
    "rate_and_state",
    "rui_wang",
    "spline",
    "tustin",
)
"""Laws whose steps have all operations of the others."""
VELOCITIES = (0.0, 1e-300, 1e-12, -1e-9, 1e-3, -0.1, 3.0, -1e6, 1e12, nan)


@pytest.fixture(scope="module")
def page():
    with opened() as page:
        yield page


def drawn(law, rng) -> np.ndarray:
    """Parameters of a law, of which half are scaled by up to 1.5 within their bounds."""
    known = parameters(law).values()
    scaled = [float(p.value) * rng.choice([1.0, rng.uniform(1.0, 1.5)]) for p in known]
    return np.clip(scaled, [p.lower for p in known], [p.upper for p in known])


@needs_browser
@pytest.mark.parametrize("name", ALL_LAWS)
def test_the_force_in_the_browser_is_that_of_python(name, page):
    law, rng = ALL_LAWS[name](), np.random.default_rng(1)
    function = steady(law)
    inputs = [i.steady for i in law.inputs]
    speeds = [*VELOCITIES, *rng.standard_normal(30), *1e-3 * rng.standard_normal(30)]
    rows = [([v, rng.uniform(1.0, 20.0), *inputs], drawn(law, rng)) for v in speeds]
    found = evaluated(page, function, rows)
    off = misses(found, in_python(function, rows), 1e-12)[:, 0]
    assert not off.any(), [(r, f) for r, f, o in zip(rows, found, off, strict=True) if o]
    default = [float(p.value) for p in parameters(law).values()]
    v = np.array(speeds[3:7])
    found = evaluated(page, function, [([x, 2.0, *inputs], default) for x in v])[:, 0]
    assert found == pytest.approx(steady_force(law, v, 2.0), rel=1e-9, abs=1e-12)


@needs_browser
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n not in DIVERSE)) for n in ALL_LAWS]
)
def test_steps_in_the_browser_are_those_of_python(name, page):
    law, rng = ALL_LAWS[name](), np.random.default_rng(0)
    others = {i.name for i in law.inputs}
    made = [sliders.loop] * ("F_e" not in others) + [sliders.belt] * (others <= {"F_e"})
    for model in made if name != "exact_coulomb" else ():
        block = plant_block(model(law), method="rodas3")
        start, typical, p = (
            np.array([float(getattr(v, what)) for v in group])
            for group, what in (
                (block.states, "start"), (block.states, "nominal"), (block.parameters, "start")
            )
        )  # fmt: skip
        rows = [
            (start + size * typical * rng.standard_normal(start.size),
             p * rng.uniform(0.7, 1.4, p.size), ())
            for size in rng.choice([0.0, 1e-3, 0.3, 3.0, nan], 40)
        ]  # fmt: skip
        found = evaluated(page, block.step, rows)
        assert not misses(found, in_python(block.step, rows), 1e-12).any(), model


def show(page, name: str, folder: Path) -> None:
    """Open the sliders of a law."""
    text = written(name, ALL_LAWS[name]()).replace("../_static", ".")
    for path in SHARED:
        (folder / path.name).write_text(path.read_text("utf-8"), "utf-8")
    head = "<!DOCTYPE html><meta charset=utf-8><link rel=stylesheet href=sliders.css>"
    (folder / "page.html").write_text(f"{head}{text}", "utf-8")
    page.goto((folder / "page.html").as_uri())


@needs_browser
@pytest.mark.parametrize(
    ("mu_d", "said"),
    [("Home", "halving the step changes the curve by 0 of the peak."),
     ("End", "halving the step changes the curve by")],
)  # fmt: skip
def test_a_force_of_zero_is_exact(page, tmp_path: Path, mu_d, said):
    show(page, "coulomb", tmp_path)
    page.locator("[data-name=lawmu_d]").press(mu_d)
    page.wait_for_selector("[data-compared=true]")
    assert said in page.locator("[data-figure=loop] figcaption").inner_text()


@needs_browser
def test_sliders_move_the_curves(page, tmp_path: Path):
    law = LuGre()
    show(page, "lugre", tmp_path)
    curves = page.locator(".curve")

    def shown() -> list[str]:
        return [curves.nth(k).get_attribute("d") or "" for k in range(curves.count())]

    def said(name: str) -> str:
        return page.locator(f"[data-figure={name}] svg").get_attribute("aria-label") or ""

    before = shown()
    assert len(before) == 4 and not any("NaN" in path for path in before)
    top = steady_force(law, np.array([page.evaluate("about.window")]) * 0.3, NORMAL_FORCE)[0]
    assert 0 < top < float(said("steady").split()[-2])
    for name, changed in (("law" + "sigma_0", {1, 2, 3}), ("beltk", {3}), ("contactf", {1, 2})):
        page.locator(f"[data-name={name}]").press("PageUp")
        page.wait_for_selector("[data-compared=true]")
        assert {k for k, path in enumerate(shown()) if path != before[k]} >= changed - {1}, name
        page.get_by_role("button").click()
        page.wait_for_selector("[data-compared=true]")
        assert shown() == before
    page.locator("[data-name=lawmu_d]").press("End")
    assert page.locator(".warning").inner_text() == "The law is made for mu_d ≤ mu_s."
    page.get_by_role("button").click()
    page.wait_for_selector("[data-compared=true]")
    note = page.locator("[data-figure=belt] figcaption").inner_text()
    assert "0.001 s by RODAS3" in note and "halving the step changes the curve by" in note
    rows = page.evaluate(
        "() => { let x = about.runs.belt.start; const p = [...['m', 'k', 'v_belt'].map(n => "
        "about.belt.find(i => i.name === n).value), ...about.law.map(i => i.value), 1e-3];"
        "return Array.from({length: 20000}, () => (x = belt(x, p, []))[0]); }"
    )
    error = page.evaluate("about.runs.belt.error")
    t = 1e-3 * np.arange(1, 20001)
    exact = simulate(Rabinowicz(law).model(), 20.0, t_eval=t, rtol=1e-9)["x"]
    off = np.abs(np.array(rows) - exact).max() / np.abs(exact).max()
    assert off == pytest.approx(error, rel=0.05) and off < 1e-5


@pytest.mark.parametrize("name", ["lugre", "steady_state_lugre", "quarter_car_simple"])
def test_the_block_sticks_and_slides(name):
    """The block moves with the belt for 2 s; its spring then reaches less than 1.5 m of 2 m."""
    x = simulate(sliders.belt(ALL_LAWS[name]()), 20.0, t_eval=[2.0, 20.0])["x"]
    assert x[0] == pytest.approx(0.2, rel=0.05) and x[1] < 1.5


@pytest.mark.parametrize(
    ("value", "lower", "upper", "role", "expected"),
    [
        (0.1, 0.0, inf, "level", (0.0, 0.3, False)),
        (1e5, 1e-12, inf, "stiffness", (1e3, 1e7, True)),
        (2.0, 0.1, 10.0, "shape", (0.1, 10.0, True)),
        (50.0, 1.0, 1000.0, "shape", (1.0, 1000.0, True)),
        (-7.0, -30.0, 30.0, "shape", (-30.0, 30.0, False)),
        (0.0, 0.0, inf, "viscous", (0.0, 5.0, False)),
        (0.0, -inf, 0.999, "shape", (-5.0, 0.999, False)),
        (-25.0, -inf, inf, "velocity scale", (-100.0, 75.0, False)),
    ],
)  # fmt: skip
def test_a_slider_covers_the_range_of_a_parameter(value, lower, upper, role, expected):
    p = Variable("a", "1", lower=lower, upper=upper)
    found = slider("a", p, value, role, 5.0)
    assert (found["low"], found["high"], found["log"]) == pytest.approx(expected)


def test_a_page_is_small():
    """The build refuses larger pages; see `written`."""
    shared = sum(path.stat().st_size for path in SHARED)
    assert len(written("dahl", ALL_LAWS["dahl"]()).encode()) + shared < MOST


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL_LAWS)
def test_every_page_is_small_and_accurate(name):
    (about,) = re.findall(r"const about = (.*);\n", written(name, ALL_LAWS[name]()))
    assert all(run["error"] <= SMALL for run in json.loads(about)["runs"].values())
