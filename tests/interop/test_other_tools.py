"""Laws inside the tools of others: Opti, CasADi's integrators, rockit, do-mpc, acados."""

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from ensembles import assert_same

from symfric import LuGre, rabinowicz, simulate_many
from symfric.bench.interop import QUICK, integrators, move
from symfric.bench.ocp import attempted, contenders
from symfric.bench.ocp_cases import CASES
from symfric.bench.ocp_contenders import Attempt
from symfric.bench.ocp_referee import judged
from symfric.bench.report import Row

EXAMPLES = Path(__file__).parents[2] / "examples" / "interop"
MISS = {"flow": 2e-3, "collocation": 1e-3}
"""Of laws that equal steps do not quite resolve [m, m/s]."""


def needs(tool: str) -> None:
    if tool not in ("opti", "acados") and find_spec(tool) is None:
        pytest.skip(f"needs {tool} (extra peers)")


@pytest.fixture(scope="module")
def opti() -> dict[tuple[str, str], Row]:
    return {(k, route): move("opti", route, k) for k in QUICK for route in MISS}


def test_opti_hits_lugre_through_flow_a_hundred_times_better_than_by_collocation(
    opti: dict[tuple[str, str], Row],
) -> None:
    for (law, route), found in opti.items():
        assert found["status"] == "", (law, route)
        assert found["iterations"] <= 30
        assert found["miss [m]"] < MISS[route], (law, route)
    by_flow, by_collocation = (opti["lugre", route] for route in MISS)
    assert by_flow["iterations"] <= 15
    assert by_flow["miss [m]"] < 5e-6 < 1e-5 < by_collocation["miss [m]"]


@pytest.mark.filterwarnings("ignore::FutureWarning")  # how do-mpc hands NumPy to CasADi
@pytest.mark.parametrize("tool", ["rockit", "do_mpc"])
@pytest.mark.parametrize("route", MISS)
def test_other_tools_find_what_opti_finds(
    tool: str, route: str, opti: dict[tuple[str, str], Row]
) -> None:
    needs(tool)
    found = move(tool, route, "lugre")
    assert found["status"] == ""
    assert found["cost J [N^2 s]"] == pytest.approx(
        opti["lugre", route]["cost J [N^2 s]"], rel=1e-5
    )
    assert found["miss [m]"] == pytest.approx(opti["lugre", route]["miss [m]"], rel=0.2)


@pytest.mark.parametrize("law", QUICK)
def test_casadis_integrators_take_the_model_and_agree(law: str) -> None:
    errors = {row["integrator"]: row["largest error [m]"] for _, row in integrators(law)}
    assert errors["symfric"] < 1e-5
    assert max(errors["cvodes"], errors["idas"]) < 1e-4
    assert not errors["rk"] < 1e-2  # explicit steps do not resolve friction, and do not say so


def printed(name: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py")],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_acados_gets_functions_that_compile_to_the_law(tmp_path: Path) -> None:
    reported = printed("acados_drive", tmp_path)
    pairs = re.findall(r"(-\d+\.\d+) [^,]*, by \w+ (-\d+\.\d+)", reported)
    assert len(pairs) == 2
    assert all(a == b for a, b in pairs)


def test_rockit_example(tmp_path: Path) -> None:
    needs("rockit")
    misses = re.findall(r"simulated ([-+][\d.]+) um", printed("rockit_lugre", tmp_path))
    assert abs(float(misses[0])) < 1.0 and abs(float(misses[1])) < 100.0


def test_do_mpc_example(tmp_path: Path) -> None:
    needs("do_mpc")
    (miss,) = re.findall(r": ([-+][\d.]+) mm from", printed("do_mpc_drive", tmp_path))
    assert abs(float(miss)) < 0.05


def test_executor_of_dask_gives_the_same() -> None:
    distributed = pytest.importorskip("distributed", reason="extra: pip install symfric[cluster]")
    model, x0 = rabinowicz(LuGre()), {"v": [-0.1, -0.03, 0.02, 0.1]}
    serial = simulate_many(model, 2.0, x0=x0, executor="serial", chunk=1)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as executor,
    ):
        other = simulate_many(model, 2.0, x0=x0, executor=executor, chunk=1, workers=2)
    assert_same(serial, other)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of the other tools
@pytest.mark.parametrize(
    ("tool", "name"),
    [("rockit", "rockit 0.01"), ("nosnoc", "nosnoc"), ("do_mpc", "do-mpc 0.01"),
     ("opty", "opty 0.01"), ("dymos", "Dymos 0.01")],
)  # fmt: skip
def test_contenders_push_a_block_out_and_back(tool: str, name: str) -> None:
    """J = 438.645 with exact friction; intervals and smooth friction cost less than 6 %."""
    needs(tool)
    (case,) = (case for case in CASES if case.name == "pushed_block")
    found, _ = attempted(contenders(quick=False)[name], case, 60.0)
    assert isinstance(found, Attempt), found
    cost, miss = judged(case, found.edges, found.controls)
    assert cost == pytest.approx(438.645, rel=0.06)
    assert cost == pytest.approx(found.claimed, rel=0.01)
    assert miss < 0.05
