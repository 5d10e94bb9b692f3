"""C of units compiles without a warning, and their descriptions hold what other tools ask for."""

import shutil
from xml.etree import ElementTree as Xml
from zipfile import ZipFile

import casadi as ca
import pytest
from backends import needs_compiler

from symfric import ExactCoulomb, LuGre
from symfric.codegen.runner import WARNINGS
from symfric.fmu import export_fmu
from symfric.fmu.export import KINDS
from symfric.fmu.variables import direct
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError, Compiler
from symfric.model import Model, Output
from symfric.scenes import Drive, Pendulum, Rabinowicz, SliderCrank

compilers = [pytest.param(Compiler((path,)), id=name) for name in ("gcc", "clang")
             if (path := shutil.which(name))]  # fmt: skip


SCENES = {
    "ode": Drive(LuGre()),
    "events": Pendulum(ExactCoulomb()),
    "loops": SliderCrank(ExactCoulomb()),
}
heavy = pytest.mark.heavy


@pytest.mark.parametrize("compiler", compilers)
@pytest.mark.parametrize(
    ("what", "fmi", "kind"),
    [*(pytest.param("ode", fmi, kind) for fmi in (2, 3) for kind in KINDS),
     *(pytest.param("events", 2 + k, kind, marks=heavy) for k, kind in enumerate(KINDS)),
     *(pytest.param("loops", 3 - k, kind, marks=heavy) for k, kind in enumerate(KINDS))],
    ids=str,
)  # fmt: skip
def test_no_warnings(what, fmi, kind, compiler, tmp_path, monkeypatch):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: None)
    unit = export_fmu(SCENES[what], tmp_path / "unit.fmu", fmi=fmi, kind=kind)
    assert unit.binary == ""
    assert "no C compiler" in str(unit)
    ZipFile(unit.path).extractall(tmp_path)
    source = str(tmp_path / "sources" / "all.c")
    assert "warning" not in compiler.run("-std=c99", *WARNINGS, "-fsyntax-only", source)


def described(what, folder, monkeypatch, fmi):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: None)
    unit = export_fmu(what, folder / "unit.fmu", fmi=fmi, rtol=1e-7, t_end=3.0)
    root = Xml.fromstring(ZipFile(unit.path).read("modelDescription.xml"))
    return root, {v.get("name"): v for v in root.find("ModelVariables")}


def test_description_of_2_0(tmp_path, monkeypatch):
    root, variables = described(Drive(LuGre(), turning=True), tmp_path, monkeypatch, 2)
    units = {u.get("name"): u[0].attrib for u in root.find("UnitDefinitions") if len(u)}
    assert units["N m"] == {"kg": "1", "m": "2", "s": "-2"}
    assert units["rad/s"] == {"rad": "1", "s": "-1"}
    assert root.find("DefaultExperiment").attrib["stopTime"] == "3.0"
    assert root.find("CoSimulation/SourceFiles/File").get("name") == "all.c"
    v, real = variables["m"], variables["m"].find("Real")
    assert (v.get("causality"), v.get("variability"), v.get("initial")) == (
        "parameter",
        "tunable",
        "exact",
    )
    assert (real.get("unit"), real.get("start"), real.get("min")) == ("kg m^2", "0.8", "1e-12")
    assert variables["x"].find("Real").get("nominal") == "0.1"
    assert variables["z"].get("initial") == "approx"
    assert variables["x"].get("initial") == "exact"
    assert "position" in variables["x"].get("description")
    assert variables["rtol"].find("Real").get("start") == "1e-07"


def test_what_outputs_depend_on_directly(tmp_path, monkeypatch):
    root, variables = described(Pendulum(LuGre()), tmp_path, monkeypatch, 3)
    needs = {u.get("valueReference"): u.get("dependencies") for u in root.find("ModelStructure")
             if u.tag == "Output"}  # fmt: skip
    assert set(needs.values()) == {""}  # no input
    assert len(needs) == sum(v.get("causality") == "output" for v in variables.values())
    root, variables = described(Rabinowicz(LuGre()), tmp_path, monkeypatch, 3)
    assert [v.get("causality") for v in variables.values()].count("independent") == 1


def test_an_output_that_an_input_reaches_through_equations_depends_on_it():
    x, z, w, u = (Variable(n, "m") for n in ("x", "z", "w", "u"))
    model = Model(
        name="m", x=(x,), z=(z, w), u=(u,), ode=-x.symbol,
        alg=ca.vertcat(z.symbol - u.symbol, w.symbol - 2 * x.symbol),
        outputs={"a": Output(z.symbol, "m"), "b": Output(w.symbol + 1, "m"), "c": Output(2.0, "m")},
    )  # fmt: skip
    assert direct(model) == {"z": ("u",), "w": ("x",), "a": ("u",), "b": ("x",), "c": ()}


def test_what_equations_share_passes_on_through_all_of_them():
    """z - w = u, w - q = 0, q = x: each unknown may depend on all that drives any of them."""
    x, z, w, q, u = (Variable(n, "m") for n in "xzwqu")
    alg = ca.vertcat(z.symbol - w.symbol - u.symbol, w.symbol - q.symbol, q.symbol - x.symbol)
    model = Model(name="m", x=(x,), z=(z, w, q), u=(u,), ode=-x.symbol, alg=alg)
    assert direct(model) == dict.fromkeys("zwq", ("u", "x"))


@pytest.mark.parametrize("fmi", [2, 3])
def test_degrees_count_from_where_water_freezes(fmi, tmp_path, monkeypatch):
    T = Variable("T", "degC", start=20.0)
    model = Model(name="m", x=(T,), ode=-T.symbol)
    root, _ = described(model, tmp_path, monkeypatch, fmi)
    bases = [unit[0].attrib for unit in root.iter("Unit") if unit.get("name") == "degC"]
    assert bases == [{"K": "1", "offset": "273.15"}]


@pytest.mark.parametrize(("step", "variability"), [(None, "tunable"), (1e-3, "fixed")])
def test_a_tolerance_is_set_where_there_is_one(step, variability, tmp_path, monkeypatch):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: None)
    unit = export_fmu(Drive(LuGre()), tmp_path / "unit.fmu", step=step)
    (tolerance,) = (entry for entry in unit.variables if entry.name == "rtol")
    assert tolerance.variability == variability
    assert ("without effect" in tolerance.doc) is (step is not None)


@needs_compiler
def test_a_broken_compiler_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("symfric.fmu.package.find_compiler", lambda: Compiler(("false",)))
    with pytest.raises(CompileError, match="false"):
        export_fmu(Drive(LuGre()), tmp_path / "unit.fmu")
    assert not list(tmp_path.iterdir())
