"""On a machine with a graphics processor: results equal those of the CPU, and run times.

`pytest tests/symfric/integrator/cuda -m "slow or not slow" -rs` on such a machine, with the extra
'cuda'; elsewhere everything here is skipped, and says why.
"""

import numpy as np
import pytest
from device_cases import CASES

from symfric import simulate_many
from symfric.bench.ensemble import cuda
from symfric.bench.report import Report
from symfric.cli.campaigns import show
from symfric.integrator.cuda.device import Device, DeviceError


def missing() -> str:
    try:
        Device.found()
    except DeviceError as error:
        return str(error)
    return ""


WHY = missing()
pytestmark = pytest.mark.skipif(bool(WHY), reason=f"no GPU: {WHY}")


@pytest.mark.parametrize("case", CASES)
def test_members_are_those_of_the_cpu_but_for_last_digits(case: str) -> None:
    make, t_end, arguments = CASES[case]
    model = make()
    ours = simulate_many(model, t_end, backend="cuda", **arguments)
    cpu = simulate_many(model, t_end, backend="vm", **arguments)
    assert ours.failed.keys() == cpu.failed.keys()
    np.testing.assert_allclose(ours.reached, cpu.reached, rtol=1e-6)
    np.testing.assert_allclose(ours.attempts, cpu.attempts, rtol=0.1, atol=3)
    for name in model.signals:
        np.testing.assert_array_equal(np.isnan(ours[name]), np.isnan(cpu[name]))
        scale = np.nanmax(np.abs(cpu[name]), initial=1e-9)
        np.testing.assert_allclose(ours[name], cpu[name], rtol=0.0, atol=3e-5 * scale)


@pytest.mark.slow
def test_a_million_members(capsys: pytest.CaptureFixture[str]) -> None:
    measured = Report().collect({"cuda": cuda})
    with capsys.disabled():
        show(measured.shown())
    for row in measured.tables["Ensembles on a graphics processor and on all cores"]:
        limit = 1e-4 if row["type"] == "double" else 1e-2
        assert row["relative difference at the end"] < limit
