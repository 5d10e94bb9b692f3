"""The colours of curves, seen with colour-blind eyes, on paper and in grey."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.foundation.style import COLOURS, CYCLE, DASHES, line

Array = NDArray[np.float64]

EYES = {
    "normal": np.eye(3),
    "protanopia": np.array([[0.152286, 1.052583, -0.204868],
                            [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968],
                              [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779],
                            [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
}  # fmt: skip
"""Linear RGB as dichromats see it: Machado, Oliveira, Fernandes, IEEE TVCG 15 (2009), table 1."""

XYZ = np.array([[0.4124564, 0.3575761, 0.1804375],
                [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
"""Linear sRGB to XYZ (IEC 61966-2-1)."""


def linear(text: str) -> Array:
    c = np.array([int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(rgb: Array) -> Array:
    x = XYZ @ np.clip(rgb, 0.0, 1.0) / (XYZ @ np.ones(3))
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("eyes", EYES)
def test_any_two_colours_differ_for_all_eyes(eyes: str) -> None:
    seen = {text: lab(EYES[eyes] @ linear(text)) for text in COLOURS}
    near = min(float(np.linalg.norm(seen[a] - seen[b])) for a, b in combinations(COLOURS, 2))
    assert near > 25.0
    tab10 = [lab(EYES[eyes] @ linear(text)) for text in ("#9467bd", "#1f77b4")]
    assert eyes in ("normal", "tritanopia") or np.linalg.norm(tab10[0] - tab10[1]) < 10.0


def test_every_colour_stands_out_from_paper() -> None:
    contrast = [1.05 / (XYZ[1] @ linear(text) + 0.05) for text in COLOURS]
    assert min(contrast) > 3.0  # what WCAG 2.1 asks of graphics


def test_four_curves_differ_in_grey_and_28_in_colour_or_line_style() -> None:
    grey = sorted(lab(linear(text))[0] for text in COLOURS[:4])
    assert np.diff(grey).min() > 7.0
    assert len({(one["color"], str(one["linestyle"])) for one in CYCLE}) == len(CYCLE) == 28
    for k in range(28):
        assert line(k)["linestyle"] != line(k + 1)["linestyle"]
        assert line(k)["color"] != line(k + 1)["color"]
        assert line(k) == line(k + 28)
    assert line(0)["linestyle"] == DASHES[0] == "-"
    assert line(3, 0) == {"color": COLOURS[3], "linestyle": "-"}
