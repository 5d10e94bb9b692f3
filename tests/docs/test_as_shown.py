"""What Sphinx shows: bars of absolute values, types of arrays, scripts, names of authors."""

from importlib.util import find_spec

import pytest

from docs.machine import rst
from docs.machine.gallery_pages import without_docstring

needs_sphinx = pytest.mark.skipif(find_spec("sphinx") is None, reason="needs Sphinx (extra docs)")


@needs_sphinx
def test_bars_stand_close_to_what_they_hold() -> None:
    from docutils import nodes  # noqa: PLC0415

    from docs.machine.sphinx_math import mathml  # noqa: PLC0415

    for written in (r"|a| + |b|", r"\lvert a\rvert + \lvert b \rvert"):
        found = mathml(nodes.math(written, written), as_block=False)
        assert found.count('lspace="0" rspace="0">|</mo>') == 4, found


@needs_sphinx
def test_arrays_in_signatures_read_as_they_are_written() -> None:
    from docs.machine.sphinx_pages import short  # noqa: PLC0415

    array = "~numpy.ndarray[tuple[~typing.Any, ...], ~numpy.dtype[~numpy.float64]]"
    given, back = short(None, "", "", None, None, f"(t: {array}, n: int)", array)
    assert (given, back) == ("(t: NDArray[float64], n: int)", "NDArray[float64]")
    assert short(None, "", "", None, None, None, None) == (None, None)


def test_functions_stand_without_the_words_above_them() -> None:
    bare = "def f(x):\n    return x\n"
    said = '"""M."""\n\ndef f(x):\n    """Title.\n\n    More.\n    """\n    return x\n\ny = 1\n'
    assert without_docstring(said, "f") == without_docstring(f"{bare}\ny = 1\n", "f") == bare


def test_an_initial_begins_no_list() -> None:
    assert rst.plain("A. Janot: x_1") == r"A\. Janot: x\_1"
    assert rst.plain("1) so") == r"1\) so"
    assert rst.plain("2.5 m") == "2.5 m"


def test_a_dash_in_a_table_begins_no_list() -> None:
    assert rst.table(["a", "b"], [["x", "-"]]).rstrip().endswith("   * - x\n     - \\-")
