"""Pages and pictures: everything is there, nothing is unescaped, long data stay small."""

import re
from pathlib import Path

import numpy as np
import pytest
from fits import make

from identification.data.findings import Finding
from identification.result.build import cut_envelope, envelope
from identification.result.fitted import Fitted
from identification.result.page import page_of

NASTY = '<img src=x onerror=alert(1)> & "quotes"'


def tags(page: str) -> list[str]:
    return re.findall(r"<(\w+)", page)


class Ranked:
    """A ranking of two laws."""

    def to_dict(self) -> dict[str, object]:
        return {
            "rows": [{"law": "stribeck", "bic": 12.5, "error": None}, {"law": NASTY, "bic": 99}]
        }


@pytest.fixture(scope="module")
def fit() -> Fitted:
    finding = Finding("clipping", 0, "force", NASTY, 0.0, 1.0, "warning")
    return make(records=2, starts=3, findings=(finding,), call=NASTY)


def test_the_page_has_every_part_and_needs_nothing_from_elsewhere(fit: Fitted) -> None:
    page = page_of(fit, Ranked())
    assert re.findall(r"<h[12][^>]*>([^<]+)", page) == [
        "stribeck", "Parameters", "Data and fit", "Force against velocity", "Residuals", "Starts",
        "Ranking of laws", "Data warnings", "How it was made",
    ]  # fmt: skip
    addresses = re.findall(r"(?:src|href|xlink:href)=\"([^\"]*)", page)
    assert addresses and all(address.startswith("#") for address in addresses)
    assert not {"script", "img", "link", "iframe"} & {*tags(page)}
    assert tags(page).count("svg") == 2 * (4 + 1 + 2 + 1)  # each chart holds its frame
    assert "http" not in page
    assert page.count("&lt;img src=x") == 3
    assert "Stribeck(mu_s=" in page
    found = tags(plain := page_of(fit))
    assert found.count("caption") == found.count("table") == found.count("thead")
    assert "Ranking of laws" not in plain


def test_errors_in_the_data_stand_first() -> None:
    finding = Finding("frozen", 0, "x", "x stands still.", 0.0, 1.0, "error")
    page = page_of(make(records=1, starts=1, n=300, findings=(finding,)))
    assert page.index("<h2>Data warnings") < page.index("<h2>Parameters")


def test_a_page_of_long_records_stays_small() -> None:
    short, long = (len(page_of(make(records=1, starts=1, n=n))) for n in (3_000, 12_000))
    assert long < 1.3 * short < 250_000


def test_no_spike_is_lost_and_the_ends_stay() -> None:
    t = np.arange(100_000.0)
    y = np.sin(t / 3000)
    y[[777, 50_001]] = 9.0, -9.0
    line = envelope(t, y, 500)
    assert line.t.size <= 500
    assert (line.y.max(), line.y.min()) == (9.0, -9.0)
    assert (line.t[0], line.t[-1]) == (0.0, 99_999.0)
    assert (np.diff(line.t) > 0).all()
    few = envelope(t[:10], np.where(t[:10] == 3, np.nan, y[:10]), 500)
    assert few.t.size == 9


def test_no_line_is_drawn_across_a_gap() -> None:
    t = np.concatenate([np.arange(0, 1, 1e-3), np.arange(3, 4, 1e-3)])
    line = cut_envelope(t, np.ones(t.size), 400)
    (gap,) = np.flatnonzero(np.isnan(line.y))
    assert line.t.size <= 402
    assert line.t[gap - 1] == t[999]
    assert line.t[gap + 1] == 3.0
    assert not np.isnan(cut_envelope(t[:1000], t[:1000], 400).y).any()


def test_the_picture_has_units_on_every_axis(fit: Fitted, tmp_path: Path) -> None:
    figure = fit.plot(tmp_path / "fit.svg")
    labels = [axis.get_ylabel() for axis in figure.axes]
    assert labels[0] == "friction [N]"
    assert labels.count("force [N]") == 2
    assert labels.count("autocorrelation") == 2
    assert figure.axes[0].get_xlabel() == "v [m/s]"
    assert (tmp_path / "fit.svg").read_text().startswith("<?xml")
    with pytest.raises(ValueError, match="force"):
        fit.plot(names=["forc"])
