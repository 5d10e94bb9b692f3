"""Pages and pictures: everything is there, nothing is unescaped, long data stay small."""

from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from fits import make

from identification.data.findings import Finding
from identification.result.fitted import Fitted
from identification.result.page import page_of
from identification.result.series import cut_envelope, envelope

NASTY = '<img src=x onerror=alert(1)> & "quotes"'


class Reader(HTMLParser):
    """Headings, elements and addresses of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.headings: list[str] = []
        self.inside = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.inside = tag
        self.addresses += [v or "" for name, v in attrs if name in ("src", "href", "xlink:href")]

    def handle_data(self, data: str) -> None:
        if self.inside in ("h1", "h2"):
            self.headings.append(data.strip())

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""


def read(page: str) -> Reader:
    found = Reader()
    found.feed(page)
    return found


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
    found = read(page)
    assert [h for h in found.headings if h] == [
        "stribeck", "Parameters", "Data and fit", "Force against velocity", "Residuals", "Starts",
        "Ranking of laws", "Data warnings", "How it was made",
    ]  # fmt: skip
    assert all(address.startswith("#") for address in found.addresses)
    assert not {"script", "img", "link", "iframe"} & set(found.tags)
    assert found.tags.count("svg") == 2 * (4 + 1 + 2 + 1)  # each chart holds its frame
    assert "http" not in page
    assert page.count("&lt;img src=x") == 3
    assert "Stribeck(mu_s=" in page


def test_tables_have_captions_and_heads(fit: Fitted) -> None:
    found = read(page_of(fit))
    assert found.tags.count("caption") == found.tags.count("table") == found.tags.count("thead")
    assert "Ranking of laws" not in found.headings


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
