"""Defects of loops in generated C, and of the steps of the elements in them."""

from mutants.mutant import Mutant

ROLLING = "symfric/emitter/rolling.py"
SEGMENTS = "symfric/emitter/segments.py"
ARRAYS = "symfric/emitter/arrays.py"
ELEMENT = "symfric/laws/dynamic/element.py"
T_ARRAYS = ("tests/symfric/emitter/test_arrays.py",)
T_ELEMENTS = ("tests/symfric/codegen/blocks/test_elements.py",)

LOOPS = (
    Mutant(
        "elements with other operations are taken for alike", ROLLING,
        "if any(node.op != first.op for node in nodes):", "if False:", T_ARRAYS,
    ),
    Mutant(
        "rows that do not follow each other are taken for an array", ROLLING,
        "if any(entry != (group, row + i) for i, entry in enumerate(entries)):", "if False:",
        T_ARRAYS,
    ),
    Mutant(
        "constants that differ become that of the first element", ROLLING,
        "elif node.op == ca.OP_CONST and len(set(lanes)) > 1:",
        "elif node.op == ca.OP_CONST and len(set(lanes)) > 99:", T_ARRAYS,
    ),
    Mutant(
        "a loop reads what an earlier one has written", SEGMENTS,
        "if any(text in _texts(later.body, read) for later in loops[i + 1 :]):", "if False:",
        T_ARRAYS,
    ),
    Mutant(
        "an element reads what the one before has written", SEGMENTS,
        "if any(offset < store.first - array.first for offset in own):", "if False:", T_ARRAYS,
    ),
    Mutant(
        "a loop overwrites what is read once after it", ARRAYS,
        "or (uses[entry] and any(a.holds(*entry) for a in lost))", "", T_ARRAYS,
    ),
    Mutant(
        "a value is computed behind the loop that needs it", SEGMENTS,
        "            ask(i, loop.stage - 1)\n", "            ask(i, loop.stage)\n", T_ARRAYS,
    ),
    Mutant(
        "a sum begins twice with its first element", ROLLING,
        "after[a - 1] if a else None", "after[a - 1] if a else terms[0]", T_ARRAYS,
    ),
    Mutant(
        "short loops are written, too", SEGMENTS, "SPARED = 8", "SPARED = 0", T_ELEMENTS,
    ),
    Mutant(
        "names that count from 0 are a family", "symfric/codegen/blocks/variables.py",
        "sorted(rows) == [*range(1, len(rows) + 1)]",
        "sorted(rows) == [*range(min(rows), min(rows) + len(rows))]", T_ELEMENTS,
    ),
    Mutant(
        "an element keeps its mode at rest no more", ELEMENT,
        "smooth.choose(self.still, p, 0.0)", "smooth.choose(self.still, 0.0, 0.0)",
        ("tests/symfric/laws/dynamic/test_element.py",),
    ),
    Mutant(
        "what the limit cuts off the mean is a rectangle", ELEMENT,
        "goal - gap * (gap / (k * self.some)) / 2", "goal - gap * (gap / (k * self.some))",
        ("tests/symfric/laws/dynamic/test_element.py",),
    ),
    Mutant(
        "growth that is no number is taken as it is", "symfric/codegen/blocks/held_step.py",
        "FASTEST = 1.0", "FASTEST = 1e9", ("tests/symfric/codegen/blocks/test_held_step.py",),
    ),
    Mutant(
        "a state rests where others were before the step", "symfric/codegen/blocks/held_step.py",
        "place = ca.substitute(rest[i], z, ca.vertcat(*others))", "place = rest[i]",
        ("tests/symfric/codegen/blocks/test_held_step.py",),
    ),
)  # fmt: skip
