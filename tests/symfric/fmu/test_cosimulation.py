"""Units of FMI 2.0 through their C interface: the bits of `simulate`, however they are stepped."""

import numpy as np
import pytest
from units import Archive, Second, over

from symfric import BrownMcPhee, Hold, LuGre, simulate
from symfric.fmu import export_fmu
from symfric.foundation.compiler import find_compiler
from symfric.scenes import Drive, Pendulum, Rabinowicz

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="units are run as machine code")
RTOL, SPAN = 1e-9, 2.0


def tuned(unit):
    return [e.name for e in unit.variables if e.causality == "parameter" and e.name != "rtol"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Unit, archive and model of a scene, exported once."""
    known = {}

    def make(scene):
        key = type(scene).__name__
        if key not in known:
            folder = tmp_path_factory.mktemp(key)
            exported = export_fmu(scene, folder / "unit.fmu", fmi=2, rtol=RTOL, t_end=SPAN)
            model = scene.model(tuned(exported))
            known[key] = Archive(exported.path, folder / "open"), model
        return known[key]

    return make


@pytest.mark.parametrize("scene", [Rabinowicz(BrownMcPhee()), Pendulum(BrownMcPhee())])
def test_an_undriven_unit_has_the_bits_of_simulate(made, scene):
    archive, model = made(scene)
    unit, times = Second(archive), np.arange(17) / 8  # whose sums are exact
    assert unit.begin(stop=SPAN) == 0
    names = [v.name for v in model.x]
    found = over(unit, times, names)
    same = simulate(model, SPAN, t_eval=times, rtol=RTOL)
    assert (found == np.array([same[n] for n in names]).T).all()
    unit.free()


def test_a_driven_unit_has_the_bits_of_simulate_with_held_inputs(made):
    archive, model = made(Drive(LuGre()))
    unit, times = Second(archive), np.arange(17) / 8
    assert unit.begin() == 0
    force = 2.0 * np.sin(np.pi * times)
    held = dict(zip(times, force, strict=True))
    found = over(unit, times, ["x", "v"], lambda t: {"force": held[t]})
    same = simulate(model, SPAN, t_eval=times, rtol=RTOL, u={"force": Hold(times, force)})
    for column, name in zip(found.T, ("x", "v"), strict=True):
        assert (column == same[name]).all()
    unit.free()
