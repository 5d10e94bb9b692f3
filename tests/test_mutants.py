"""Mutants are drawn by their seed alone, and each is another program."""

import ast

import mutants


def test_mutants_follow_from_the_seed_and_compile() -> None:
    under = ["symfric/laws/static", "ocp/solve.py"]
    drawn = mutants.drawn(40, 3, under, set())
    assert drawn == mutants.drawn(40, 3, under, set()) != mutants.drawn(40, 4, under, set())
    assert len({(m.file, m.first) for m in drawn}) == 40
    for m in drawn:
        source = (mutants.ROOT / m.file).read_text(encoding="utf-8")
        lines = source.splitlines()
        lines[m.first - 1 : m.last] = [m.new]
        assert ast.dump(ast.parse("\n".join(lines))) != ast.dump(ast.parse(source))


def test_a_mutant_changes_neither_messages_nor_annotations() -> None:
    body = ast.parse('x: int | None = 1 + 2\nraise ValueError(f"{a + b}")\ny = f"{a - b}"').body
    found = [ast.unparse(new) for e in mutants._expressions(body) for new in mutants.changed(e)]
    assert found == ["1 - 2"]


def test_tests_of_a_file_are_in_the_folder_that_mirrors_it() -> None:
    assert mutants.nearest("symfric/laws/static/coulomb.py") == "tests/symfric/laws"
    step = "tests/symfric/integrator/methods"
    assert mutants.nearest("symfric/integrator/methods/attempt.py") == step
    assert mutants.nearest("ocp/solve.py") == "tests/ocp"
