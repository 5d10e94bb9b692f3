from pathlib import Path

import numpy as np
import pytest

from identification.data.dataset import Dataset

T = np.arange(200) / 100.0
DATA = Dataset.of(t=T, x=np.sin(T), force=np.cos(T))


def test_records_of_several_are_kept_apart() -> None:
    both = DATA + DATA.between(0.5, 1.0)
    assert [record.size for record in both] == [200, 51]
    assert (len(both), both.size, both[1].time[0]) == (2, 251, 0.5)
    first, rest = both.split(0.25)
    assert [r.size for r in first] == [50, 13]
    assert first.size + rest.size == both.size
    assert rest[0].time[0] == pytest.approx(0.5)
    assert [record.size for record in both.thinned(10)] == [20, 6]


def test_records_without_samples_between_are_left_out() -> None:
    later = Dataset.of(t=T + 10.0, x=np.sin(T), force=np.cos(T), name="later")
    (only,) = (DATA + later).between(10.5, 11.0)
    assert (only.name, only.size) == ("later", 51)


def test_slides_and_shafts_do_not_mix() -> None:
    turns = Dataset.of(t=T, x=T, force=T, units="rad, N m")
    assert turns.rotary and not DATA.rotary


def test_a_file_written_is_the_record_again(tmp_path: Path, stage_data: Dataset) -> None:
    (file,) = stage_data.to_csv(tmp_path / "a.csv")
    for signal in ("t", "x", "force"):
        np.testing.assert_array_equal(Dataset.read(file)[0][signal], stage_data[0][signal])
    files = (DATA + DATA).to_csv(tmp_path / "b.csv")
    assert [f.name for f in files] == ["b_1.csv", "b_2.csv"]
    turns = Dataset.of(t=T, x=T, force=T, spring_2=T, units="deg, N mm")
    again = Dataset.read(turns.to_csv(tmp_path / "c.csv"))
    assert again.rotary and "spring_2" in again[0]


def test_records_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        DATA[0]["x"][0] = 1.0


def test_the_controller_follows_the_samples(stage_data: Dataset) -> None:
    loop, cut = stage_data[0].loop, stage_data.between(1.0, 2.0)[0].loop
    np.testing.assert_array_equal(cut.reference, loop.reference[1000:2001])
    assert stage_data.thinned(2)[0].loop is None
    assert stage_data.resampled(0.002)[0].loop is None


def test_renamed_signals_are_found_under_both_names() -> None:
    record = DATA.renamed({"x": "theta"})[0]
    np.testing.assert_array_equal(record["theta"], np.sin(T))


def test_irregular_times_are_refused_by_uniform_and_put_right_by_resampled() -> None:
    rng = np.random.default_rng(0)
    t = T + 2e-3 * rng.random(T.size)
    data = Dataset.of(t=t, x=np.sin(t), force=np.cos(t))
    record = data.resampled()[0].uniform()
    np.testing.assert_allclose(record["x"], np.sin(record.time), atol=1e-6)
    np.testing.assert_allclose(record["force"], np.cos(record.time), atol=3e-5)


def test_interpolated_positions_converge_of_third_order() -> None:
    """Halving the interval of uneven samples divides the error by 8 or more."""

    def error(n: int) -> float:
        u = np.linspace(0, 1, n)
        t = 2 * (u + 0.05 * np.sin(6 * u))
        record = Dataset.of(t=t, x=np.sin(3 * t)).resampled(2e-3)[0]
        inner = slice(50, -50)
        return float(np.abs(record["x"] - np.sin(3 * record.time))[inner].max())

    assert error(50) / error(100) > 7.0


def test_gaps_split_a_record_and_are_never_bridged() -> None:
    whole = np.delete(np.arange(200), slice(80, 130))
    data = Dataset.of(t=T[whole], x=np.sin(T[whole]), force=np.cos(T[whole]))
    pieces = data.resampled()
    ends = [(r.time[0], r.time[-1]) for r in pieces]
    assert np.ravel(ends) == pytest.approx([0.0, 0.79, 1.30, 1.99])
    one_missing = np.delete(np.arange(200), 80)
    assert len(Dataset.of(t=T[one_missing], x=T[one_missing]).resampled(gap="refuse")) == 1


def test_a_delay_moves_one_signal() -> None:
    late = Dataset.of(t=T, x=np.sin(T), force=np.cos(T - 0.025))
    record = late.delayed({"force": -0.025})[0]
    np.testing.assert_allclose(record["force"], np.cos(record.time), atol=2e-5)
    np.testing.assert_allclose(record["x"], np.sin(record.time), atol=1e-12)
    assert record.size == T.size - 3


def test_a_dataset_describes_its_contents() -> None:
    assert "data: 0 ... 1.99 s, 200 samples, x [m], force [N]" in str(DATA)
