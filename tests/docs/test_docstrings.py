"""Docstrings become markup that says the same."""

from docs.machine.rst import entries, first_line, sentence, to_rst

DOC = """Does a thing with |v| and x_ of `Law`.

    F = N v

It goes on here,
in one paragraph.

    run = simulate(model, t_end=1.0)

Limits: none.
Source: nobody, 1999.

Args:
    a: first,
        longer.
    b, c: others.
        "one": a choice
        "two": another

Returns:
    Something, such as
    this.

Raises:
    ValueError: if not.
"""


def test_sections_become_lists_and_blocks_stay() -> None:
    shown = to_rst(DOC, formulas=False)
    assert r"Does a thing with \|v\| and x\_ of ``Law``." in shown
    assert shown.count(".. code-block:: text") == 2
    assert "It goes on here, in one paragraph." in shown
    assert "**Limits.** none." in shown and "**Source.** nobody, 1999." in shown
    assert "``a``\n   first, longer.\n" in shown
    assert '``b``, ``c``\n   others.\n\n   "one": a choice\n\n   "two": another\n' in shown
    assert "**Returns**\n\nSomething, such as this.\n" in shown
    assert "``ValueError``\n   if not.\n" in shown


def test_equations_become_formulas_where_they_are_asked_for() -> None:
    shown = to_rst("Title.\n\n    F = N v\n", formulas=True)
    assert ".. math::" in shown and ".. code-block" not in shown


def test_tables_in_text_stay_as_they_are() -> None:
    shown = to_rst("Title.\n\nshape    slope    class\ntanh     1        C∞\n")
    assert "   shape    slope    class\n   tanh     1        C∞\n" in shown


def test_names_touching_words_are_parted_by_nothing() -> None:
    assert sentence("`a`s and (`b`)") == r"``a``\ s and (``b``)"


def test_pieces() -> None:
    assert first_line("One\ntwo.\n\nThree.") == "One two."
    assert entries("a: b\n    c\nd: e") == ["a: b\n    c", "d: e"]
