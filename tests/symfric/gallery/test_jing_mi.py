"""The paper's tables again: the stored numbers are consistent, and our side of them runs."""

import pytest

from symfric.gallery.selection.belt import peaked
from symfric.gallery.selection.tables import PRINTED, PaperComparison, PaperRow, compare_with_paper


def of_tables(first: bool) -> PaperComparison:
    """A comparison that holds the printed numbers alone."""
    rows = tuple(
        PaperRow(name, *((p.T4, p.S4) if first else (p.T8, p.S8))) for name, p in PRINTED.items()
    )
    return PaperComparison("", "", "", 1.0, 1e-4, rows)


def test_ranks_of_table_5_follow_from_table_4() -> None:
    """The places that table 5 prints, in its order of laws."""
    orders = of_tables(first=True).orders()
    printed = {
        ("J", "T"): {"Bengisu": 4, "Karnopp": 3, "Velocity-based": 1, "Awrejcewicz": 2, "LuGre": 6,
                     "Elasto-plastic": 8, "Stick-slip": 5, "Gonthier": 7},
        ("J", "S"): {"Bengisu": 4, "Karnopp": 5, "Velocity-based": 3, "Awrejcewicz": 1, "LuGre": 8,
                     "Elasto-plastic": 6, "Stick-slip": 2, "Gonthier": 7},
        ("S", "T"): {"Bengisu": 1, "LuGre": 3, "Elasto-plastic": 5, "Stick-slip": 2, "Gonthier": 4},
        ("S", "S"): {"Bengisu": 2, "LuGre": 5, "Elasto-plastic": 3, "Stick-slip": 1, "Gonthier": 4},
        ("Y", "T"): {"Dahl": 1, "LuGre": 2, "Elasto-plastic": 4, "Gonthier": 3},
        ("J+S", "S"): {"Bengisu": 2, "Stick-slip": 1},
        ("J+S+Y", "T"): {"LuGre": 1, "Elasto-plastic": 3, "Gonthier": 2},
        ("J+S+Y", "S"): {"LuGre": 3, "Elasto-plastic": 1, "Gonthier": 2},
    }  # fmt: skip
    for (column, by), places in printed.items():
        order = orders[column][f"printed {by}"]
        assert {name: order.index(name) + 1 for name in order} == places, (column, by)


def test_ranks_of_table_9_follow_from_table_8() -> None:
    orders = of_tables(first=False).orders()
    assert orders["J"]["printed T"][:4] == ["Bengisu", "Awrejcewicz", "Karnopp", "Velocity-based"]
    assert orders["J"]["printed S"][-3:] == ["Bengisu", "Karnopp", "Awrejcewicz"]
    assert orders["J+S+Y"]["printed S"] == ["Elasto-plastic", "Gonthier", "LuGre"]


def test_one_motion_has_several_s_and_the_order_needs_its_numbers() -> None:
    found = compare_with_paper("rabinowicz", ["Velocity-based", "Threlfall"])
    first, second = found.rows
    assert first.S_uniform == pytest.approx(0.147, abs=2e-3)  # Karnopp's closed form: 0.1476
    assert first.S_steps > 1.2 * first.S_uniform
    assert second.S_uniform == pytest.approx(0.0966, abs=1e-3)
    assert 100 < first.attempts < 1000
    assert first.explicit_step is not None
    assert first.explicit_step > 1e-6  # the step that the paper prints
    text = "\n".join(found.lines())
    assert max(map(len, found.lines())) <= 80
    assert "standard deviation" in text
    assert "2.20" in text


def test_the_box_of_the_paper_moves_as_far() -> None:
    found = compare_with_paper("pendulum_box", ["Smooth"])
    (row,) = found.rows
    assert row.S_uniform == pytest.approx(row.S, rel=0.05)
    assert row.explicit_step is None
    assert "no explicit method takes this machine" in " ".join(found.lines())


def test_other_scenes_are_refused() -> None:
    with pytest.raises(ValueError, match="expected one of rabinowicz, pendulum_box"):
        compare_with_paper("drive")


def test_every_peaked_law_has_to_peak() -> None:
    assert peaked({"Bengisu": 1.4, "Stick-slip": 1.9, "Coulomb": 1.0})
    for wrong in (1.2, 2.0):
        assert not peaked({"Bengisu": 1.4, "Stick-slip": wrong})
