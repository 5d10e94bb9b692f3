import numpy as np
import pytest

from ocp.formulation.expressions import integral
from ocp.formulation.phase import FREE, Phase, Span
from ocp.formulation.problem import Problem
from symfric import BrownMcPhee, Model
from symfric.multibody import JointSpringDamper
from symfric.scenes import SliderCrank

SCENE = SliderCrank(BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02), omega=0.0)


def crank() -> Model:
    m = SCENE.mechanism()
    m.force(JointSpringDamper("motor", "crank", "turn", actuator=m.input("torque", "N m")))
    return m.build()


MODEL = crank()


def spanned(**start: object) -> Span:
    (span,) = Problem(Phase(MODEL, 0.5, start=start), integral(lambda s: s.torque**2)).spans
    return span


def slider(crank: float) -> float:
    """The closed form of `SliderCrank`."""
    b, c, e, r, rod = SCENE.b, SCENE.c, SCENE.e, SCENE.r, SCENE.l
    across, down = b - r * np.sin(crank), c - e + r * np.cos(crank)
    return np.sqrt(rod**2 - across**2 - down**2)


def test_coordinates_that_are_not_named_close_the_loop() -> None:
    span = spanned(crank=1.0, crank_rate=2.0)
    start = {name: low for name, (low, high) in span.nodes[0.0].items() if low == high}
    assert start["crank"] == 1.0
    assert start["slider"] == pytest.approx(slider(1.0), abs=1e-11)
    speed = (slider(1.0 + 1e-6) - slider(1.0 - 1e-6)) / 1e-6
    assert start["slider_rate"] == pytest.approx(speed, rel=1e-7)
    assert span.rows_at[0.0] == ()
    default = {v.name: v.start for v in MODEL.x}
    assert spanned().nodes[0.0]["slider"][0] == default["slider"]


@pytest.mark.parametrize("rate", [{}, {"crank_rate": FREE}])
def test_loop_that_starts_in_a_range_is_open(rate: dict[str, object]) -> None:
    """Its constraints close it; at rest all rates are zero and need none."""
    span = spanned(crank=(0.5, 1.0), **rate)
    start = span.nodes[0.0]
    assert start["crank"] == (0.5, 1.0)
    assert start["slider"] == FREE
    assert start["slider_rate"] == (FREE if rate else (0.0, 0.0))
    assert span.rows_at[0.0] == ()


def test_start_that_cannot_close_the_loop_is_refused() -> None:
    with pytest.raises(ValueError, match="start: expected positions from which all loops can be"):
        spanned(crank=1.0, slider=0.9)
