"""Pictures of laws carry names and units, choose their windows and show what sets a law apart."""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from symfric import BrownMcPhee, Karnopp, LuGre, law_from_text, with_values
from symfric.figures import compare, hysteresis
from symfric.figures.pictures import behaviours, decades, plot_catalogue, plot_laws, window
from symfric.foundation.status import SolveError, Status
from symfric.laws import steady_force


def titles(drawn: Figure) -> list[str]:
    return [axis.get_title(loc="left") for axis in drawn.axes]


def test_a_law_of_the_velocity_alone_is_its_steady_curve() -> None:
    drawn = plot_laws({"a": BrownMcPhee()}, N=2.0)
    near, far = drawn.axes
    assert near.get_xlabel() == far.get_xlabel() == "v [mm/s]"
    assert near.get_ylabel() == far.get_ylabel() == "F [N]"
    assert far.get_xscale() == "log"
    assert near.lines[0].get_ydata().max() == pytest.approx(0.3, rel=1e-2)
    v = 1e-3 * near.lines[0].get_xdata()
    assert near.lines[0].get_ydata() == pytest.approx(steady_force(BrownMcPhee(), v, 2.0))
    assert drawn.get_suptitle() == "a   N = 2 N"
    assert plt.get_fignums() == []


def test_a_law_with_states_shows_its_loops() -> None:
    drawn = plot_laws({"lugre": LuGre()})
    assert titles(drawn)[2:] == ["pre-sliding, loops in a loop", "lag, v up and down"]
    loop, lag = drawn.axes[2:]
    assert (loop.get_xlabel(), loop.get_ylabel()) == ("x [µm]", "F [N]")
    assert loop.lines[0].get_xdata().max() == pytest.approx(1e6 * 2 * 0.15 / 1e5, rel=1e-6)
    assert [line.get_label() for line in lag.lines] == ["5 Hz", "50 Hz", "steady"]


def test_sticking_is_shown_where_a_law_needs_the_applied_force() -> None:
    pulled, moved = plot_laws({"karnopp": Karnopp()}, N=10.0).axes[2:]
    assert (pulled.get_xlabel(), moved.get_ylabel()) == ("F_e [N]", "v [m/s]")
    x, y = (np.asarray(values) for values in pulled.lines[0].get_data())
    first = x.argmax()
    stuck = x[:first] < 0.9 * 1.5
    assert np.abs(y - x)[:first][stuck].max() < 0.01


def test_several_laws_have_one_legend_and_each_panel_those_that_can() -> None:
    laws = {name: law_from_text(name) for name in ("brown_mcphee", "lugre", "dahl")}
    drawn = plot_laws(laws)
    assert [len(axis.lines) for axis in drawn.axes] == [3, 3, 2, 1, 1]
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == list(laws)
    own = {line.get_label(): line.get_color() for line in drawn.axes[0].lines}
    assert drawn.axes[3].lines[0].get_color() == own["lugre"]


def test_a_behaviour_that_fails_is_left_out_with_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise SolveError("it stopped at 1 s", Status.SUCCESS)

    monkeypatch.setattr("symfric.figures.pictures.hysteresis", fails)
    laws = {"lugre": LuGre()}
    assert titles(plot_laws(laws))[2:] == ["lag, v up and down"]


def test_behaviours_and_window_around_rest_are_those_of_the_law() -> None:
    shown = {
        "coulomb+viscous": "", "dahl": "hysteresis transition", "gonthier": "hysteresis lag dwell",
        "rate_and_state": "velocity_step dwell", "karnopp": "stiction", "wojewoda": "lag",
        "bam": "input_tau_m input_tau_e", "quarter_car_general": "input_x_rel input_v_rel",
        "lagged(stribeck)": "lag",
    }  # fmt: skip
    assert {law: " ".join(behaviours(law_from_text(law))) for law in shown} == shown
    halves = {"brown_mcphee": 0.0121, "bittencourt": 5.0, "dahl": 5e-4, "viscous": 1.0,
              "rate_and_state": 1.58e-5}  # fmt: skip
    found = {law: window(law_from_text(law), 1.0) for law in halves}
    assert found == pytest.approx(halves, rel=0.01)


def test_viscous_friction_does_not_hide_the_curve_over_decades() -> None:
    law = with_values(law_from_text("stribeck"), {"sigma_2": 40.0})
    low, high = decades(law, 1.0)
    assert low == pytest.approx(1e-6)
    assert steady_force(law, np.array([high]), 1.0)[0] < 2.2 * 0.15
    assert decades(law_from_text("stribeck"), 1.0)[1] == pytest.approx(0.1)


def test_a_law_that_is_not_odd_shows_both_sides_over_decades() -> None:
    far = plot_laws({"capstan": law_from_text("capstan")}).axes[1]
    assert [line.get_label() for line in far.lines] == ["capstan", "capstan: -F(-v)"]
    ahead, back = (np.asarray(line.get_ydata()) for line in far.lines)
    v = 1e-3 * np.asarray(far.lines[0].get_xdata())
    assert ahead == pytest.approx(steady_force(law_from_text("capstan"), v, 1.0))
    assert -back == pytest.approx(steady_force(law_from_text("capstan"), -v, 1.0))
    assert ahead[-1] > 1.3 * back[-1]  # exp(mu phi) - 1 against 1 - exp(-mu phi)


def test_catalogue_has_a_panel_of_its_own_scale_for_every_law() -> None:
    laws = {f"law {k}": BrownMcPhee(v_t=10.0**-k) for k in range(7)}
    shown = [axis for axis in plot_catalogue(laws, N=2.0).axes if axis.get_visible()]
    assert [axis.get_title() for axis in shown] == [f"{name} [N]" for name in laws]
    units = [axis.get_xticklabels()[1].get_text() for axis in shown]
    assert units == ["m/s", "m/s", "m/s", "mm/s", "mm/s", "mm/s", "µm/s"]
    for k, axis in enumerate(shown):
        size = {"m/s": 1.0, "mm/s": 1e3, "µm/s": 1e6}[units[k]]
        edge = size * window(laws[f"law {k}"], 2.0)
        assert axis.lines[0].get_xdata().max() == pytest.approx(edge)
        assert axis.lines[0].get_ydata().max() == pytest.approx(0.3, rel=1e-2)
    edges = [window(law, 2.0) for law in laws.values()]
    assert all(b == pytest.approx(a / 10, rel=0.2) for a, b in pairwise(edges))


def test_a_figure_prints_its_note_and_its_units() -> None:
    drawn = compare(["lugre", "coulomb"], "hysteresis").plot()
    (axis,) = drawn.axes
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("x [µm]", "F [N]")
    assert axis.get_title(loc="left").startswith("without coulomb: expected")
    assert plt.get_fignums() == []


def test_one_colour_a_law_one_line_style_a_case() -> None:
    drawn = compare(["lugre", "gms"], "lag").plot()
    lines = drawn.axes[0].lines
    assert [line.get_label() for line in lines[:3]] == [
        "lugre, 2 Hz",
        "lugre, 5 Hz",
        "lugre, 10 Hz",
    ]
    assert len({line.get_color() for line in lines[:3]}) == 1
    assert len({line.get_color() for line in lines}) == 2
    assert len({str(line._dash_pattern) for line in lines[:3]}) == 3  # type: ignore[attr-defined]
    assert drawn.axes[0].get_title(loc="left") == "not drawn: steady"


def test_loops_of_several_laws_are_drawn_at_one_labelled_speed() -> None:
    figure = compare(["lugre", "maxwell_slip"], "hysteresis").plot()
    (axis,) = figure.axes
    assert [line.get_label() for line in axis.lines] == ["lugre, 1x", "maxwell_slip, 1x"]
    assert axis.get_title(loc="left") == "not drawn: 5x, 20x"
    assert len(hysteresis(LuGre()).plot().axes[0].lines) == 3  # of one law
