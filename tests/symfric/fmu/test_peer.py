"""Units validated and simulated by FMPy, and compiled with its headers."""

from pathlib import Path

import numpy as np
import pytest

from symfric import BrownMcPhee, Hold, LuGre, law_from_text, simulate
from symfric.fmu import export_fmu
from symfric.fmu.export import KINDS
from symfric.fmu.package import compile_unit
from symfric.foundation.programs import find_compiler
from symfric.scenes import ALL_SCENES

WHY = "the validator of FMPy: pip install symfric[fmu]"
fmpy = pytest.importorskip("fmpy", reason=WHY)
validation = pytest.importorskip("fmpy.validation", reason=WHY)
compiler = find_compiler()
pytestmark = pytest.mark.skipif(compiler is None, reason="units are run as machine code")
RTOL, STEP = 1e-9, 0.1
versions = pytest.mark.parametrize("fmi", [2, 3])


@versions
@pytest.mark.parametrize(
    "scene",
    ["rabinowicz", "drive", "quarter_car", "pendulum", "double_pendulum", "pendulum_box",
     *(pytest.param(name, marks=pytest.mark.heavy)
       for name in ("slider_crank", "four_mass", "four_bar", "arm"))],
)  # fmt: skip
def test_units_are_valid_and_follow_simulate(scene, fmi, tmp_path):
    machine = ALL_SCENES[scene](BrownMcPhee())
    unit = export_fmu(machine, tmp_path / "unit.fmu", fmi=fmi, rtol=RTOL)
    assert validation.validate_fmu(str(unit.path)) == []
    model = machine.model([e.name for e in unit.variables if e.causality == "parameter"][:-1])
    times = np.arange(round(min(machine.t_end, 3.0) / STEP) + 1) * STEP
    given = {v.name: np.sin(3 * times) for v in model.u}
    driven = np.array(
        list(zip(times, *given.values(), strict=True)), [(n, "f8") for n in ("time", *given)]
    )
    names = [v.name for v in model.x]
    found = fmpy.simulate_fmu(
        str(unit.path), stop_time=times[-1], step_size=STEP, output_interval=STEP, output=names,
        input=driven if given else None,
    )  # fmt: skip
    held = {name: Hold(times, values) for name, values in given.items()}
    same = simulate(model, times[-1], t_eval=times, rtol=RTOL, u=held)
    for name in names:
        assert np.abs(found[name] - same[name]).max() <= 10 * RTOL * np.abs(same[name]).max(), name


@versions
@pytest.mark.parametrize("law", ["brown_mcphee", "exact_coulomb"])
def test_another_integrator_follows_simulate(law, fmi, tmp_path):
    machine = ALL_SCENES["pendulum"](law_from_text(law))
    unit = export_fmu(machine, tmp_path / "unit.fmu", fmi=fmi, kind="model-exchange")
    assert validation.validate_fmu(str(unit.path)) == []
    model = machine.model([e.name for e in unit.variables if e.causality == "parameter"])
    found = fmpy.simulate_fmu(
        str(unit.path), stop_time=2.0, output_interval=0.5, relative_tolerance=1e-8,
        output=["phi"], solver="CVode",
    )  # fmt: skip
    assert abs(found["phi"][-1] - simulate(model, 2.0, rtol=RTOL).final["phi"]) < 1e-6


@versions
@pytest.mark.parametrize("kind", KINDS)
def test_declarations_agree_with_the_headers_of_the_standard(fmi, kind, tmp_path):
    """The unit compiles with the official header instead of its own."""
    unit = export_fmu(ALL_SCENES["drive"](LuGre()), tmp_path / "unit.fmu", fmi=fmi, kind=kind)
    folder = Path(fmpy.extract(str(unit.path), str(tmp_path / "open"))) / "sources"
    official = Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h"
    include = f'#define FMI3_OVERRIDE_FUNCTION_PREFIX\n#include "{official}"\n'
    (folder / f"fmi{fmi}.h").write_text(include)
    compile_unit(compiler, folder, tmp_path / "unit.so", f"-I{official.parent}", "-Werror")
