"""Forces printed in a catalogue of friction laws, computed there by an independent program.

Levels 1 N and 1.5 N, characteristic velocity 1e-3 m/s; nine digits after the point.
"""

import pytest

from symfric import BrownMcPhee, Coulomb, Law, LuGre, Stribeck

V = (1e-4, 5e-4, 1e-3, 2e-3, 1e-2)
FORCES: dict[str, tuple[Law, tuple[float, ...]]] = {
    "brown_mcphee": (
        BrownMcPhee(mu_s=1.5, mu_d=1.0, v_t=1e-3),
        (0.468248208, 1.342725805, 1.499329300, 1.326530387, 1.007540767),
    ),
    "coulomb_tanh": (
        Coulomb(mu_d=1.0, v_eps=1e-3),
        (0.099667995, 0.462117157, 0.761594156, 0.964027580, 0.999999996),
    ),
}
STRIBECK: dict[float, tuple[float, ...]] = {
    0.78: (1.423540613, 1.279287385, 1.183939721, 1.089790325, 1.001208056),
    1.0: (1.452418709, 1.303265330, 1.183939721, 1.067667642, 1.000022700),
    2.0: (1.495024917, 1.389400392, 1.183939721, 1.009157819, 1.000000000),
    3.2: (1.499684621, 1.448446451, 1.183939721, 1.000051049, 1.000000000),
}


@pytest.mark.parametrize(
    ("law", "v", "F"),
    [(law, v, F) for law, row in FORCES.values() for v, F in zip(V, row, strict=True)],
)
def test_force_has_the_printed_digits(law: Law, v: float, F: float) -> None:
    assert law.force(v, 1.0) == pytest.approx(F, abs=5.1e-10)
    assert law.force(-v, 1.0) == pytest.approx(-F, abs=5.1e-10)


CURVE = [(d, v, g) for d, row in STRIBECK.items() for v, g in zip(V, row, strict=True)]


@pytest.mark.parametrize(("delta", "v", "g"), CURVE)
def test_stribeck_force_has_the_printed_digits_above_the_smoothing(
    delta: float, v: float, g: float
) -> None:
    law = Stribeck(mu_s=1.5, mu_d=1.0, v_s=1e-3, delta=delta, v_eps=1e-12)
    assert law.force(v, 1.0) == pytest.approx(g, abs=1e-7 if delta < 1 else 1e-9)


@pytest.mark.parametrize(("delta", "v", "g"), CURVE)
def test_lugre_slides_at_the_printed_level(delta: float, v: float, g: float) -> None:
    law = LuGre(mu_s=1.5, mu_d=1.0, v_s=1e-3, delta=delta, v_eps=0.0)
    for N, direction in ((1.0, 1.0), (7.0, -1.0)):
        force = law.force(direction * v, N, law.steady_state(direction * v, N))
        assert force == pytest.approx(direction * N * g, abs=N * 5.1e-10)
