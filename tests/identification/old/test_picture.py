from pathlib import Path

import numpy as np

from identification import Identification


def test_picture_is_written_with_labelled_axes(stribeck: Identification, tmp_path: Path) -> None:
    figure = stribeck.plot(tmp_path / "found.png")
    assert (tmp_path / "found.png").stat().st_size > 10_000
    labels = {axis.get_ylabel() for axis in figure.axes} | {a.get_xlabel() for a in figure.axes}
    assert {"v [m/s]", "friction [N]", "force [N]", "difference [N]", "t [s]"} <= labels


def test_curve_is_the_identified_law(stribeck: Identification, tmp_path: Path) -> None:
    figure = stribeck.plot(tmp_path / "found.png")
    v, F = (np.asarray(data) for data in figure.axes[0].lines[1].get_data())
    law = stribeck.fitted_law
    np.testing.assert_allclose([law.force(x, 1.0) for x in v[::50]], F[::50])
    assert figure.axes[0].lines[0].get_xydata().shape[0] <= 6000 * 2
