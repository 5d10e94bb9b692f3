"""The ctypes loader gives the bits of the virtual machine, without symfric."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from robots import SMALL

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate, inverse_dynamics_block, law_block, plant_block
from symfric.codegen.runner import run_vm
from symfric.codegen.vectors import excitation
from symfric.emitter.c99 import REALS
from symfric.laws import GMS
from symfric.scenes import Drive

pytestmark = [pytest.mark.usefixtures("compiler"), pytest.mark.heavy]

BLOCKS = {
    "lugre": law_block(LuGre()),
    "brown_mcphee": law_block(BrownMcPhee()),
    "gms": law_block(GMS(form="event")),
    "drive": plant_block(Drive(BrownMcPhee())),
}


TWO = SMALL.replace(
    "</robot>",
    '<link name="hand"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link><joint name="elbow" type="continuous"><parent link="arm"/>'
    '<child link="hand"/><origin xyz="0 0 -0.5"/><axis xyz="0 1 0"/></joint></robot>',
)


def loaded(made):
    path = made.folder / f"{made.block.name}_ctypes.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n in ("lugre", "drive") else pytest.mark.slow) for n in BLOCKS],
)
def test_it_has_the_bits_of_the_virtual_machine(name, tmp_path):
    block = BLOCKS[name]
    module = loaded(generate(block, tmp_path, real="double"))
    inputs = excitation(block)[:200]
    columns = {v.name: inputs[:, i] for i, v in enumerate(block.inputs)}
    found = module.Block().run(**columns)
    expected = run_vm(block, REALS["double"], inputs)
    for i, output in enumerate(block.outputs, start=len(block.states)):
        assert np.array_equal(found[output], expected[:, i])
    assert (found["status"] == 0).all()


def test_parameters_start_values_and_resets_are_those_of_the_c(tmp_path):
    block = BLOCKS["lugre"]
    module = loaded(generate(block, tmp_path))
    for real in ("double", "float"):
        p = [float(v.start) * (2.0 if v.name == "sigma_0" else 1.0) for v in block.parameters]
        one = module.Block(real, start={"z": 3e-6}, sigma_0=2e5)
        found = one.step(v=2e-4, N=8.0)
        z, y = block.step(3e-6, p, [2e-4, 8.0])
        rel = 1e-15 if real == "double" else 1e-5
        assert one.state.z == pytest.approx(float(z), rel=rel)
        assert [found["F"], found["F_end"]] == pytest.approx(y.full().ravel(), rel=rel)
        one.param.sigma_0 = 1e5
        one.start_by("init_sliding", v=0.1, N=8.0)
        assert one.state.z == pytest.approx(8e-6, rel=1e-6)
        one.reset()
        assert one.state.z == 0.0


def test_guards_speak_through_the_status(tmp_path):
    block = loaded(generate(LuGre(), tmp_path, real="double")).Block()
    found = block.run(v=[0.1, np.nan, 0.1], N=8.0)
    assert found["status"].tolist() == [0, 2, 0]
    assert block.status == 2
    assert np.isfinite(found["F"]).all()


def test_names_that_are_not_there_are_refused(tmp_path):
    module = loaded(generate(LuGre(), tmp_path, real="double"))
    for arguments, message in (
        ({"real": "half"}, "expected one of double"),
        ({"mu": 1.0}, "expected one of mu_s"),
        ({"start": {"y": 1.0}}, "expected one of z"),
    ):
        with pytest.raises(ValueError, match=message):
            module.Block(**arguments)
    with pytest.raises(ValueError, match="expected the inputs v, N, got v"):
        module.Block().step(v=1.0)


def test_arrays_of_the_c_are_arrays_here(tmp_path):
    block = inverse_dynamics_block(TWO)
    names = [v.name for v in block.inputs]
    assert names == ["q_1", "q_2", "qd_1", "qd_2", "qdd_1", "qdd_2"]
    made = loaded(generate(block, tmp_path, real="double")).Block()
    rows = np.random.default_rng(0).normal(size=(5, 6))
    single = made.run(**dict(zip(names, rows.T, strict=True)))
    whole = made.run(q=rows[:, :2], qd=rows[:, 2:4], qdd=rows[:, 4:])
    assert np.array_equal(whole["tau"], np.column_stack([single["tau_1"], single["tau_2"]]))
    once = made.step(q=[0, 1], qd=[0, 0], qdd=[0, 0])
    assert once["tau"] == [once["tau_1"], once["tau_2"]]
    with pytest.raises(ValueError, match="q: expected 2 numbers"):
        made.step(q=[0, 1, 2], qd=[0, 0], qdd=[0, 0])


@pytest.mark.parametrize("value", [3.0, [1e5, 1e5], [1e5] * 5])
def test_no_array_is_filled_in_part(value, tmp_path):
    made = loaded(generate(law_block(GMS(form="event")), tmp_path, real="double")).Block
    assert [*made(k=[1e5, 2e5, 3e5, 4e5]).param.k] == [1e5, 2e5, 3e5, 4e5]
    with pytest.raises(ValueError, match=r"k: expected 4 number\(s\), got"):
        made(k=value)


def test_a_library_beside_it_is_opened_and_nothing_of_symfric_is_needed(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double")
    ending = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
    target = str(tmp_path / f"brown_mcphee{ending}")
    compiler.run("-shared", "-fPIC", "-O2", str(made.source("double")), "-o", target, "-lm")
    code = (
        "import sys; sys.modules['symfric'] = None; sys.modules['subprocess'].run = None\n"
        "from brown_mcphee_ctypes import Block; print(Block().step(v=1.0, N=10.0)['F'])"
    )
    code = f"import subprocess, sys\n{code}"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    expected = float(BrownMcPhee().force(1.0, 10.0))
    assert float(done.stdout) == pytest.approx(expected, rel=1e-13)
