"""The benchmark on graphics processors: where there is none, and where one is pretended."""

import pytest

from symfric.bench import ensemble
from symfric.bench.ensemble import measure_cuda
from symfric.integrator.cuda import on_device
from symfric.integrator.cuda.device import Device, DeviceError, HostDevice


def test_without_a_graphics_processor_the_rows_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> Device:
        raise DeviceError("none here")

    monkeypatch.setattr(on_device, "find_device", missing)
    rows = measure_cuda()
    assert {(row.device, row.why, row.members) for row in rows} == {("no GPU", "none here", 0)}
    assert len(rows) == 2 * len(ensemble.CUDA_CASES)


@pytest.mark.slow
def test_members_are_compared_with_those_on_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_device, "find_device", HostDevice)
    monkeypatch.setattr(ensemble, "ON_DEVICE", 3000)
    monkeypatch.setattr(ensemble, "SAMPLE", 8)
    double, single = measure_cuda(quick=True)
    assert (double.real, single.real) == ("double", "float")
    for row in (double, single):
        assert row.members == 30
        assert row.ratio == pytest.approx(row.per_second / row.cores_per_second)
        assert row.per_second > 0
    assert double.difference < 1e-5
    assert double.difference < single.difference < 1e-3
