"""Blocks: functions, fingerprint; identical elements as arrays and their loops in C.

Parameters and texts of blocks of laws, and contacts of populations.

Plants in fixed steps: C and CasADi agree to the bit, and the step is that of the method.
"""

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram, along
from tables import Names, table

import symfric as sf
from symfric.codegen import Block, contact_block, law_block, plant_block
from symfric.codegen.blocks.block import CBlock, ElementArray
from symfric.codegen.blocks.variables import arranged, families, in_arrays, numbered
from symfric.codegen.runner import run_vm
from symfric.codegen.source import routines, source
from symfric.codegen.verification import excitation
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.foundation.graph import graph
from symfric.foundation.programs import Compiler
from symfric.integrator.methods.tableaux import METHODS
from symfric.laws import GMS, Asymmetric, LuGre, MaxwellSlip, Sum, Viscous
from symfric.laws.dynamic.maxwell_slip import Element, Slider
from symfric.scenes import Arm, DoublePendulum, Drive, Rabinowicz

x, u, p = sf.Variable("x", "m"), sf.Variable("u", "m/s"), sf.Variable("h", "s", start=0.5)


def block(**changes) -> Block:
    parts = {
        "name": "lag",
        "states": (x,),
        "inputs": (u,),
        "parameters": (p,),
        "next": x.symbol + p.symbol * u.symbol,
        "outputs": {"y": sf.Output(2 * x.symbol, "m")},
    }
    return Block(**parts | changes)


def test_functions_take_states_parameters_inputs_as_dense_columns():
    step = block().step
    assert step.name_in() == ["state", "param", "in"]
    assert step.name_out() == ["state_next", "out"]
    assert [float(v) for v in step(1.0, 0.5, 4.0)] == [3.0, 2.0]
    reset = block(resets={"init_high": (10 * u.symbol + p.symbol, "")}).reset("init_high")
    assert float(reset(99.0, 0.5, 4.0)) == 40.5
    assert block(next=ca.SX(1, 1), outputs={"y": sf.Output(0.0, "m")}).step.nnz_out(0) == 1
    y = sf.Output(u.symbol, "m")
    assert Block("f", inputs=(u,), outputs={"y": y}).is_function
    assert not Block("f", inputs=(u,), outputs={"y": y, "z": y}).is_function
    assert not block().is_function
    assert block().sample_time == 0.5
    fixed = block(parameters=(), next=x.symbol, constants={"h": 4e-3})
    assert fixed.sample_time == 4e-3
    assert Block("none", states=(x,), next=x.symbol).sample_time is None


def test_the_fingerprint_identifies_the_content():
    y = sf.Variable("x", "m")
    again = {"states": (y,), "next": y.symbol + p.symbol * u.symbol,
             "outputs": {"y": sf.Output(2 * y.symbol, "m")}}  # fmt: skip
    assert block(**again).fingerprint == block().fingerprint
    for changes in (
        {"name": "other"},
        {"next": x.symbol - p.symbol * u.symbol},
        {"outputs": {"y": sf.Output(2 * x.symbol, "mm")}},
        {"parameters": (sf.Variable("h", "s", start=0.25, symbol=p.symbol),)},
        {"resets": {"init_u": (u.symbol, "")}},
    ):
        assert block(**changes).fingerprint != block().fingerprint


def test_names_that_count_from_one_are_families_with_one_unit_and_range():
    for names, found in table(__file__)["families"].items():
        variables = tuple(sf.Variable(name, "N") for name in names.split())
        assert {family.name: [*family.rows] for family in families(variables)} == found, names
    for odd in ({"unit": "m"}, {"lower": 0.0}, {"upper": 1.0}):
        third = sf.Variable(**({"name": "k_3", "unit": "N"} | odd))
        assert not families((sf.Variable("k_1", "N"), sf.Variable("k_2", "N"), third))


def test_neighbours_become_arrays_and_joints_are_ordered_by_number_then_as_given():
    a = [sf.Variable(n, "N", symbol=ca.SX.sym(n)) for n in ("F_1", "F_2", "b", "c_1", "G_1", "G_2")]
    outputs = {n: sf.Output(a[0].symbol, "N") for n in ("G", "q_1", "q_2", "q_3")}
    made = in_arrays(Block("b", inputs=tuple(a), outputs=outputs))
    assert [*map(tuple, made.arrays)] == [("in", "F", 0, 2), ("out", "q", 1, 3)]
    z, w = sf.Variable("z", "m"), sf.Variable("w", "N")
    found, order = numbered([(z, w), (z,), (z,)], ["2", "arm", "1"])
    assert [v.name for v in found] == ["z_1", "z_2", "z_arm", "w_2"]
    assert order == [3, 0, 2, 1]


def gms(n: int, share: float = 0.0, **numbers: float) -> GMS:
    elements = (Element(5e4 * 2.0**-i, 0.1 + share * i) for i in range(n))
    return GMS(elements=tuple(elements), form="event", **numbers)


def maxwell(n: int) -> MaxwellSlip:
    return MaxwellSlip(elements=tuple(Slider(5e4 / n, 0.1 / n) for _ in range(n)), form="event")


ELEMENTS = [
    gms(1), gms(2), gms(4, share=0.05), maxwell(4), maxwell(10),
    Asymmetric(gms(4), gms(4, share=0.1, mu_s=0.2)),
    Sum((gms(4), gms(4, share=0.1), Viscous())), Sum((gms(3), maxwell(5), LuGre())),
    Sum(tuple(LuGre(mu_d=0.05 + 0.01 * i) for i in range(4))), gms(40),
]  # fmt: skip


@pytest.mark.parametrize("count", [5, pytest.param(len(ELEMENTS), marks=pytest.mark.slow)])
def test_loops_have_the_bits_of_casadi(count, compiler, tmp_path):
    """Velocities of all magnitudes with stops and reversals, loads that fall and rise."""
    blocks = [law_block(law, free=f) for law in ELEMENTS[:count] for f in (None, [])]
    program = OneProgram(blocks, tmp_path, compiler, guards=False)
    random = np.random.default_rng(5)
    v = random.choice([0.0, -0.0, 1e-300, 1e-7, 1e-3, 0.1, 30.0], 400)
    v *= np.repeat(random.choice([-1.0, 1.0], 40), 10)
    N = np.repeat(random.choice([1e-3, 10.0, 60.0, 1000.0], 20), 20)
    inputs = np.column_stack([v, N])
    rows = program.run([(k, inputs) for k in range(len(blocks))])
    for c, found in zip(program.several, rows, strict=True):
        assert np.array_equal(found, run_vm(c, inputs), equal_nan=True)


def step(block: Block) -> tuple[str, ...]:
    return routines(CBlock(block, DOUBLE, guards=False))[-1].statements


def test_arrays_are_struct_members_that_loops_of_three_and_more_elements_index():
    blocks = {n: law_block(gms(n)) for n in (2, 3, 10, 12)}
    loops = {n: [line for line in step(b) if line.startswith("for (")] for n, b in blocks.items()}
    assert [len(found) for found in loops.values()] == [0, 1, 2, 2]
    assert len(step(blocks[10])) == len(step(blocks[12])) < len(step(blocks[2]))
    ten = blocks[10]
    declared = [m.declared for rows in ten.members.values() for m in rows]
    assert declared[:2] == ["F[10]", "p[10]"]
    assert {"k[10]", "alpha[10]"} <= set(declared)
    names = [v.name for v in ten.parameters]
    first = names.index("alpha_1")
    assert names[first : first + 10] == [f"alpha_{i}" for i in range(1, 11)]
    assert [m.first for m in ten.members["param"] if m.name == "alpha"] == [first]
    assert sum(m.length for m in ten.members["param"]) == len(names)
    for law in (LuGre(), gms(2), Sum((LuGre(), LuGre()))):
        plain = law_block(law)
        assert plain.arrays == ()
        assert arranged(plain) is plain


def test_constants_that_differ_are_a_table_of_the_type():
    differing = "\n".join(step(law_block(gms(5), free=[])))
    assert differing.count("static const double") == 1
    assert "50000.0, 25000.0" in differing
    assert "static const" not in "\n".join(step(law_block(maxwell(5), free=[])))
    text = source(CBlock(law_block(gms(5), free=[]), FLOAT))
    assert "double" not in text
    assert "-0.0f; /* adds nothing" in text or "sum1 = " in text


def test_a_family_without_a_loop_stays_single_and_guarded_inputs_are_not_indexed():
    xs = [sf.Variable(f"x_{i}", "m") for i in (1, 2, 3)]
    k = [sf.Variable(f"k_{i}", "1", start=float(i)) for i in (1, 2, 3)]
    total = xs[0].symbol * k[0].symbol - xs[1].symbol / k[1].symbol * xs[2].symbol ** k[2].symbol
    single = arranged(Block(
        "b", states=tuple(xs), next=ca.vertcat(*(s.symbol for s in xs)),
        parameters=(k[0], sf.Variable("h", "s"), k[1], k[2]), outputs={"y": sf.Output(total, "m")},
    ))  # fmt: skip
    assert [v.name for v in single.parameters] == ["k_1", "h", "k_2", "k_3"]
    assert single.arrays == ()
    many = tuple(sf.Variable(f"x_{i}", "m") for i in range(1, 9))
    total = sum((v.symbol**2 * ca.sin(v.symbol) for v in many), start=ca.SX(0))
    outputs = {"y": sf.Output(total, "m"), "z": sf.Output(2 * total, "m")}
    looped = Block("b", inputs=many, outputs=outputs, arrays=(ElementArray("in", "x", 0, 8),))
    for guards in (False, True):
        lines = routines(CBlock(looped, DOUBLE, guards))[-1].statements
        assert any("in->x[i]" in line for line in lines) is not guards


def names_of(law, **options):
    return [p.name for p in law_block(law, **options).parameters]


@pytest.mark.parametrize("text", table(__file__)["constants"])
def test_only_values_that_save_a_function_call_or_have_no_effect_become_constants(text):
    law = Names().value(text)
    assert {*sf.parameters(law)} - {*names_of(law)} == {*table(__file__)["constants"][text]}


def test_free_and_fold_choose_parameters_and_constants_save_operations():
    law = LuGre()
    assert names_of(law, fold=("mu_s", "v_eps")) == [
        "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2", "h"
    ]  # fmt: skip
    assert law_block(law, fold=("mu_s", "v_eps")).constants == {
        "mu_s": 0.15, "v_eps": 1e-15, "delta": 2.0
    }  # fmt: skip
    assert names_of(law, fold=True) == ["h"]
    assert names_of(law, fold=True, h=1e-3) == []
    block = law_block(law, free=("mu_s", "delta"), h=2e-3)
    assert [p.name for p in block.parameters] == ["mu_s", "delta"]
    assert block.constants["h"] == 2e-3
    assert set(block.constants) == {"h", *sf.parameters(law)} - {"mu_s", "delta"}

    def operations(**options) -> int:
        return graph(law_block(law, **options).step).operations

    counts = [operations(free=tuple(sf.parameters(law))), operations(), operations(free=("mu_s",)),
              operations(free=(), h=1e-3)]  # fmt: skip
    assert counts == sorted(counts, reverse=True)
    assert len(set(counts)) == 4
    assert operations(fold=True, h=1e-3) == counts[-1] <= counts[0] - 8


def test_names_and_texts_are_those_of_the_law_and_its_parts():
    for text, name in (("lugre", "lugre"), ("coulomb+viscous", "coulomb_viscous"),
                       ("asymmetric(coulomb+viscous)", "asymmetric_coulomb_viscous")):  # fmt: skip
        assert law_block(sf.law_from_text(text)).name == name
    block = law_block(sf.law_from_text("asymmetric(coulomb+viscous)"))
    assert block.equations.count("F = mu_d N s(v / v_eps)") == 1
    assert block.equations.count("F = sigma_2 v") == 1
    assert block.doc.startswith("Law with different parameters")
    static = law_block(sf.Stribeck(sigma_2=0.4))
    assert static.is_function
    F = float(static.step([], [float(p.start) for p in static.parameters], [3e-4, 8.0])[1])
    assert pytest.approx(float(sf.Stribeck(sigma_2=0.4).force(3e-4, 8.0)), rel=1e-14) == F


def test_contacts_in_a_loop_are_the_population_of_numpy():
    law, h, N = sf.GenericAsperity(seed=5), 1e-4, 10.0
    block, n = contact_block(law, h=h), 200
    t = np.arange(n + 1) * h
    x = 2e-5 * np.sin(40 * t)
    start, v = law.begin(), np.diff(x) / h
    step, z, F = block.step.map(len(start.r)), start.z, np.zeros(n)
    for k in range(n):
        u = np.stack([np.full(len(start.r), v[k]), np.full(len(start.r), N), start.r])
        z, f = step(z, np.zeros((0, len(start.r))), u)
        F[k] = float(ca.sum2(f))
    np.testing.assert_allclose(F, law.force(t, x, N)[1:], rtol=1e-9, atol=1e-12)
    other = contact_block(sf.RandomBristles(), h=1e-3)
    assert any("draw r anew" in text for text in other.use)
    assert (other.constants["count"], other.constants["h"]) == (25.0, 1e-3)
    assert [v.name for v in other.inputs] == ["v", "N", "r"]
    assert [v.name for v in contact_block(law, name="one").parameters] == ["h"]


place, z, push = (
    sf.Variable("x", "m", start=1.0),
    sf.Variable("z", "1", start=0.5),
    sf.Variable("u", "m/s"),
)
LEAK = sf.Model(
    "leak",
    x=(place,),
    z=(z,),
    u=(push,),
    ode=push.symbol - z.symbol,
    alg=z.symbol + z.symbol**3 - 2 * place.symbol,
    outputs={"sum": sf.Output(place.symbol + z.symbol + push.symbol, "1")},
)
PLANT = sf.drive(LuGre(), free=["m", "offset"])
ORDERS = [m for m in METHODS if METHODS[m].order > 1]


def advanced(block: Block, steps: int, *inputs: float) -> dict[str, float]:
    """States and outputs after some steps with constant inputs and default parameters."""
    states, outputs = along(block, np.tile(inputs, (steps, 1)))
    names = [*(v.name for v in block.states), *block.outputs]
    return dict(zip(names, [*states[-1], *outputs[-1]], strict=True))


def test_every_method_has_the_bits_of_casadi(compiler: Compiler, tmp_path) -> None:
    blocks = [plant_block(LEAK if METHODS[method].dae else PLANT, h=1e-4, method=method)
              for method in METHODS]  # fmt: skip
    blocks += [plant_block(DoublePendulum(sf.BrownMcPhee(v_t=0.05)).model(), h=1e-3),
               plant_block(Drive(LuGre()))]  # fmt: skip
    program = OneProgram(blocks, tmp_path, compiler)
    inputs = [excitation(block, 100) for block in blocks]
    rows = program.run([*enumerate(inputs)])
    for c, given, found in zip(program.several, inputs, rows, strict=True):
        assert np.array_equal(found, run_vm(c, given), equal_nan=True), c.block.discretisation


@pytest.mark.parametrize(
    ("scene", "coordinates"),
    [(DoublePendulum, ("phi_1", "phi_2")),
     pytest.param(Arm, [f"q{k}" for k in range(1, 7)], marks=pytest.mark.slow)],
)  # fmt: skip
def test_bearing_friction_from_reactions_follows_simulate(scene, coordinates) -> None:
    model = scene(sf.BrownMcPhee(v_t=0.05)).model()
    block = plant_block(model, h=1e-3)
    assert sum(v.name.endswith("_N") for v in block.states) == len(coordinates)
    after = advanced(block, 200, *[0.0] * len(model.u))
    exact = sf.simulate(model, 0.2, rtol=1e-9).final
    for name in coordinates:
        assert after[name] == pytest.approx(exact[name], abs=0.01)  # order 1


def test_plants_follow_the_adaptive_simulation() -> None:
    model = sf.drive(Viscous(sigma_2=2.0), m=0.5, offset=0.3)
    exact = sf.simulate(model, 1.0, u={"force": 2.0}, rtol=1e-11).final
    for method in ORDERS:
        found = advanced(plant_block(model, h=5e-3, method=method), 200, 2.0)
        assert found == pytest.approx({name: exact[name] for name in found}, rel=2e-7), method
    model = sf.rabinowicz(LuGre())
    found = advanced(plant_block(model, h=1e-3), 4000)
    exact = sf.simulate(model, 4.0, rtol=1e-10).final
    for name in ("x", "friction"):
        assert found[name] == pytest.approx(exact[name], rel=1e-4)


def test_algebraic_variables_and_time_are_states_and_outputs_are_those_at_the_end() -> None:
    block = plant_block(LEAK, h=1e-2)
    assert [v.name for v in block.states] == ["x", "z"]
    assert block.states[1].start == pytest.approx(1.0, rel=1e-12)
    found = advanced(block, 50, 0.7)
    assert found["z"] + found["z"] ** 3 == pytest.approx(2 * found["x"], rel=1e-5)
    assert found["sum"] == pytest.approx(found["x"] + found["z"] + 0.7, rel=1e-14)
    t = ca.SX.sym("t")
    found = advanced(plant_block(sf.Model("swing", x=(place,), ode=ca.cos(t), t=t), h=1e-2), 100)
    assert found["t"] == pytest.approx(1.0, rel=1e-12)
    assert found["x"] == pytest.approx(1.0 + np.sin(1.0), rel=1e-7)


def test_implicit_model_becomes_a_plant() -> None:
    """x'^3 + x' + x = 0, with the rate r as a further state: from dx = -(1 + 3 r^2) dr and
    dt = dx / r follows t = [-ln|r| - 3/2 r^2] between its ends."""
    rate = ca.SX.sym("rate")
    model = sf.Model("drain", x=(place,), xdot=rate, residual=rate**3 + rate + place.symbol)
    block = plant_block(model, h=1e-2, method="rodas4p")
    r_0, r_1 = block.states[1].start, advanced(block, 100)["x_dot"]
    assert r_0**3 + r_0 == pytest.approx(-1.0)
    assert np.log(r_0 / r_1) + 1.5 * (r_0**2 - r_1**2) == pytest.approx(1.0, rel=1e-7)


def test_parameters_stay_variable_unless_they_select_a_form_or_are_folded() -> None:
    block = plant_block(sf.rabinowicz(LuGre(), free=["mu_s", "k"]))
    assert [p.name for p in block.parameters] == ["mu_s", "k", "h"]
    block = plant_block(Rabinowicz(LuGre()))
    law = ["mu_s", "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2", "v_eps"]
    assert [p.name for p in block.parameters] == ["m", "k", "v_belt", "g", *law, "h"]
    assert block.constants == {"delta": 2.0}
    fixed = plant_block(Rabinowicz(LuGre()), fold=True, h=1e-3)
    assert fixed.parameters == ()
    assert (fixed.constants["k"], fixed.constants["h"]) == (2.1, 1e-3)
    assert advanced(block, 50) == pytest.approx(advanced(fixed, 50), rel=1e-9, abs=1e-15)
    free = plant_block(Rabinowicz(LuGre()), free=["k"], h=1e-3)
    assert [p.name for p in free.parameters] == ["k"]


def test_mechanisms_with_friction_use_backward_euler_by_default() -> None:
    for model, options, method in (
        (sf.rabinowicz(LuGre()), {"method": "backward_euler"}, "backward Euler, order 1"),
        (sf.Model("decay", x=(place,), ode=-place.symbol), {}, "RODAS3"),
        (DoublePendulum(LuGre()).model(), {}, "backward Euler"),
    ):
        assert method in plant_block(model, **options).discretisation
