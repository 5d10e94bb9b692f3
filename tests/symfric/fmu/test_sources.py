"""C of units without warnings, their descriptions, their units, and runs of exported units."""

import shutil
from dataclasses import replace
from xml.etree import ElementTree as Xml
from zipfile import ZipFile

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from tables import sampled, table

from symfric import BrownMcPhee, ExactCoulomb, LuGre
from symfric.bench import codegen
from symfric.bench.report import GOALS, Report
from symfric.codegen.runner import WARNINGS
from symfric.fmu import export_fmu, running
from symfric.fmu.export import KINDS
from symfric.fmu.variables import direct, fixed_parameters
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, Compiler
from symfric.foundation.units import exponents, per_second
from symfric.model import Model, Output
from symfric.scenes import ALL_SCENES, Drive, Pendulum, SliderCrank

compilers = [pytest.param(Compiler((path,)), id=name) for name in ("gcc", "clang")
             if (path := shutil.which(name))]  # fmt: skip
SCENES = {
    "ode": Drive(LuGre()),
    "events": Pendulum(ExactCoulomb()),
    "loops": SliderCrank(ExactCoulomb()),
}
UNITS = table(__file__, "units")


@pytest.fixture
def no_compiler(monkeypatch):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: None)


@pytest.mark.parametrize("compiler", compilers)
@pytest.mark.parametrize(
    ("what", "fmi", "kind"),
    sampled(
        [
            *(("ode", 2, KINDS[0]), ("ode", 2, KINDS[1]), ("ode", 3, KINDS[1])),
            *(("ode", 3, KINDS[0]), ("events", 2, KINDS[0]), ("events", 3, KINDS[1])),
            *(("loops", 2, KINDS[1]), ("loops", 3, KINDS[0])),
        ],
        of=2,
    ),
    ids=str,
)
def test_no_warnings(what, fmi, kind, compiler, tmp_path, no_compiler):
    unit = export_fmu(SCENES[what], tmp_path / "unit.fmu", fmi=fmi, kind=kind)
    assert unit.binary == ""
    assert "no C compiler" in str(unit)
    ZipFile(unit.path).extractall(tmp_path)
    source = str(tmp_path / "sources" / "all.c")
    assert "warning" not in compiler.run("-std=c99", *WARNINGS, "-fsyntax-only", source)


def described(what, folder, fmi):
    unit = export_fmu(what, folder / "unit.fmu", fmi=fmi, rtol=1e-7, t_end=3.0)
    root = Xml.fromstring(ZipFile(unit.path).read("modelDescription.xml"))
    return root, {v.get("name"): v for v in root.find("ModelVariables")}


def test_the_description_lists_units_variables_and_the_experiment(tmp_path, no_compiler):
    root, variables = described(Drive(LuGre(), turning=True), tmp_path, 2)
    units = {u.get("name"): u[0].attrib for u in root.find("UnitDefinitions") if len(u)}
    assert units["N m"] == {"kg": "1", "m": "2", "s": "-2"}
    assert units["rad/s"] == {"rad": "1", "s": "-1"}
    assert root.find("DefaultExperiment").attrib["stopTime"] == "3.0"
    assert root.find("CoSimulation/SourceFiles/File").get("name") == "all.c"
    v, real = variables["m"], variables["m"].find("Real")
    assert [v.get(n) for n in ("causality", "variability", "initial")] == [
        "parameter", "tunable", "exact"
    ]  # fmt: skip
    assert [real.get(n) for n in ("unit", "start", "min")] == ["kg m^2", "0.8", "1e-12"]
    assert variables["x"].find("Real").get("nominal") == "0.1"
    assert [variables[n].get("initial") for n in "zx"] == ["approx", "exact"]
    assert "position" in variables["x"].get("description")
    assert variables["rtol"].find("Real").get("start") == "1e-07"


def test_dimensions_of_loops_and_start_values_are_fixed(tmp_path, no_compiler):
    _, variables = described(SliderCrank(BrownMcPhee()), tmp_path, 3)
    fixed = {n for n, v in variables.items() if v.get("variability") == "fixed"}
    assert {"r", "l", "omega"} <= fixed
    assert not {"m_slider", "mu_s", "g"} & fixed
    x, p, begin = Variable("x", "m"), Variable("p", "1/s", start=1.0), Variable("x_0", "m")
    model = Model(
        "m", x=(replace(x, start=2 * begin.symbol),), p=(p, begin), ode=-p.symbol * x.symbol
    )
    assert fixed_parameters(model) == {"x_0"}


@pytest.mark.parametrize("fmi", [2, 3])
def test_degrees_celsius_have_an_offset(fmi, tmp_path, no_compiler):
    T = Variable("T", "degC", start=20.0)
    root, _ = described(Model(name="m", x=(T,), ode=-T.symbol), tmp_path, fmi)
    bases = [unit[0].attrib for unit in root.iter("Unit") if unit.get("name") == "degC"]
    assert bases == [{"K": "1", "offset": "273.15"}]


def test_outputs_depend_on_what_reaches_them_through_equations(tmp_path, no_compiler):
    root, variables = described(Pendulum(LuGre()), tmp_path, 3)
    needs = [u.get("dependencies") for u in root.find("ModelStructure") if u.tag == "Output"]
    assert {*needs} == {""}  # there is no input
    assert len(needs) == sum(v.get("causality") == "output" for v in variables.values())
    assert [v.get("causality") for v in variables.values()].count("independent") == 1
    x, z, w, q, u = (Variable(n, "m") for n in "xzwqu")
    model = Model(
        name="m", x=(x,), z=(z, w), u=(u,), ode=-x.symbol,
        alg=ca.vertcat(z.symbol - u.symbol, w.symbol - 2 * x.symbol),
        outputs={"a": Output(z.symbol, "m"), "b": Output(w.symbol + 1, "m"), "c": Output(2.0, "m")},
    )  # fmt: skip
    assert direct(model) == {"z": ("u",), "w": ("x",), "a": ("u",), "b": ("x",), "c": ()}
    # z - w = u, w - q = 0, q = x: each unknown may depend on all inputs and states of the three
    alg = ca.vertcat(z.symbol - w.symbol - u.symbol, w.symbol - q.symbol, q.symbol - x.symbol)
    model = Model(name="m", x=(x,), z=(z, w, q), u=(u,), ode=-x.symbol, alg=alg)
    assert direct(model) == dict.fromkeys("zwq", ("u", "x"))


@pytest.mark.parametrize(("step", "variability"), [(None, "tunable"), (1e-3, "fixed")])
def test_only_adaptive_steps_have_a_tolerance(step, variability, tmp_path, no_compiler):
    unit = export_fmu(Drive(LuGre()), tmp_path / "unit.fmu", step=step)
    (tolerance,) = (entry for entry in unit.variables if entry.name == "rtol")
    assert tolerance.variability == variability
    assert ("without effect" in tolerance.doc) is (step is not None)
    with pytest.raises(ValueError, match="expected a binary in"), running(unit.path):
        pass


@needs_compiler
def test_a_unit_runs_and_its_refusals_are_errors(tmp_path, monkeypatch):
    unit = export_fmu(Drive(BrownMcPhee()), tmp_path / "unit.fmu")
    with running(unit.path, x=0.25, force=1.5) as one:
        assert one.get(["x", "force"]).tolist() == [0.25, 1.5]
        one.step(0.5)
        assert one.t == 0.5
        assert np.isfinite(one.get(["v"])).all()
        with pytest.raises(RuntimeError, match="more than 0 s"):
            one.step(0.0)
    refused = pytest.raises(RuntimeError, match="set m: expected a finite number")
    with refused, running(unit.path, m=-1.0):
        pass
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: Compiler(("false",)))
    with pytest.raises(CompileError, match="false"):
        export_fmu(Drive(LuGre()), tmp_path / "other.fmu")
    assert not (tmp_path / "other.fmu").exists()


@pytest.mark.slow
@needs_compiler
def test_the_benchmark_of_units_meets_its_goals(monkeypatch):
    monkeypatch.setattr(codegen, "QUICK", ("drive",))
    monkeypatch.setattr(ALL_SCENES["drive"], "t_end", 0.5)
    tables = Report().collect({"fmu": lambda: codegen.units(quick=True)}).tables
    assert len(tables[codegen.UNITS]) == len(codegen.LAWS)
    assert all(goal["met"] == "yes" for goal in tables[GOALS])
    tiny = f"attempts per step of {codegen.TINY:g} s"
    assert all(row[tiny] < 0.1 for row in tables[codegen.UNITS])


def test_units_have_exponents_and_so_have_their_rates():
    for text, expected in UNITS["exponents"].items():
        assert exponents(text) == expected, text
    assert exponents("N (s/m)^d") is exponents("furlong") is None
    for text, same in UNITS["equal"].items():
        assert exponents(text) == exponents(same), text
    for text, rate in UNITS["rates"].items():
        assert per_second(text) == rate
        assert exponents(rate) is not None
