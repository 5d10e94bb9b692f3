"""The unit test of a kit passes on the code that was generated, and on no other."""

import csv
import re
import subprocess
from pathlib import Path

import pytest
from law_cases import CASES, NO_STEP

from symfric import BrownMcPhee, LuGre, law_from_text
from symfric.codegen import Generated, generate, plant_block
from symfric.codegen.runner import FLAGS, WARNINGS
from symfric.foundation.programs import Compiler
from symfric.laws import GMS, MaxwellSlip
from symfric.scenes import ALL_SCENES, Rabinowicz

pytestmark = pytest.mark.heavy

STRICT = [*FLAGS, *WARNINGS, "-Werror"]
LAWS = {
    "lugre": LuGre(),
    "brown_mcphee": BrownMcPhee(),
    "gms": GMS(form="event"),
    "sum": law_from_text("lugre+dahl"),
}


def built(made: Generated, real: str, compiler: Compiler, folder: Path, *flags: str) -> Path:
    source = made.source(real)
    test, target = source.with_name(f"{source.stem}_test.c"), folder / "test"
    compiler.run(*STRICT, *flags, str(test), str(source), "-o", str(target), "-lm")
    return target


def passes(program: Path) -> bool:
    return subprocess.run([program], check=False, timeout=20).returncode == 0


slow = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "guards"),
    [
        ("lugre", True),
        ("brown_mcphee", True),
        ("brown_mcphee", False),
        *(pytest.param(name, g, marks=slow) for name in ("gms", "sum") for g in (True, False)),
        pytest.param("lugre", False, marks=slow),
    ],
)
def test_it_passes_here_without_a_warning(
    name: str, guards: bool, compiler: Compiler, tmp_path: Path
) -> None:
    made = generate(LAWS[name], tmp_path, guards=guards)
    for real in made.reals:
        assert passes(built(made, real, compiler, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rabinowicz", "maxwell_slip"])
def test_it_passes_for_plants_and_forms_that_yield(
    name: str, compiler: Compiler, tmp_path: Path
) -> None:
    block = plant_block(Rabinowicz(LuGre())) if name == "rabinowicz" else MaxwellSlip(form="event")
    made = generate(block, tmp_path)
    for real in made.reals:
        assert passes(built(made, real, compiler, tmp_path))


def test_fused_multiply_add_and_fast_math_stay_within_the_tolerance(
    compiler: Compiler, tmp_path: Path
) -> None:
    made = generate(LuGre(), tmp_path, real="float", guards=False)
    flags = ("-ffp-contract=fast", "-march=native") if "gcc" in str(compiler) else ()
    assert passes(built(made, "float", compiler, tmp_path, *flags))


def mutants(text: str, factor: str) -> dict[str, str]:
    """Line -> the source with the number that this line makes a little wrong."""
    found: dict[str, str] = {}
    lines = text.splitlines(keepends=True)
    begin = next(i for i, line in enumerate(lines) if line.startswith("{"))
    for i, line in enumerate(lines[begin:], start=begin):
        made = re.match(
            r"    +(?:(?:const )?(?:float|double) [\w]+ =|[\w>.\-\[\]]+ =|return) (.*);$", line
        )
        if made and not re.search("->|_start|status|0u|bool", made[1]):
            changed = line.replace(f"{made[1]};", f"{factor} * ({made[1]});")
            found[line] = "".join([*lines[:i], changed, *lines[i + 1 :]])
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "real"), [("lugre", "double"), ("brown_mcphee", "double"), ("brown_mcphee", "float")]
)
def test_it_fails_when_any_line_of_arithmetic_is_changed_by_a_thousandth(
    name: str, real: str, compiler: Compiler, tmp_path: Path
) -> None:
    """Of LuGre in float, the series for phi2 near zero may change so much within rounding."""
    made = generate(LAWS[name], tmp_path, real=real, guards=False)
    changed = mutants(made.source(real).read_text(), "1.001f" if real == "float" else "1.001")
    assert len(changed) >= 4
    alive: list[str] = []
    for line, text in changed.items():
        made.source(real).write_text(text)
        if passes(built(made, real, compiler, tmp_path)):
            alive.append(line)
    assert not alive


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.15f, ", "0.1501f, "),
        ("_start;", "_start; state->z = 0.0f;"),
        ("status |= LUGRE_F32_STATE", "status |= 0u"),
        ("const float sigma_1 = param->sigma_1;", "const float sigma_1 = 190.0f; (void)param;"),
    ],
    ids=["default", "same", "status", "parameter"],
)
def test_a_wrong_default_status_or_parameter_is_found(
    old: str, new: str, compiler: Compiler, tmp_path: Path
) -> None:
    made = generate(LuGre(), tmp_path, real="float")
    text = made.source("float").read_text()
    assert old in text
    made.source("float").write_text(text.replace(old, new))
    found = passes(built(made, "float", compiler, tmp_path))
    assert found is (old == "_start;")  # the start value of z is 0: that one changes nothing


def test_a_result_that_is_no_number_is_wrong(compiler: Compiler, tmp_path: Path) -> None:
    made = generate(BrownMcPhee(), tmp_path, real="double", guards=False)
    text = made.source("double").read_text()
    made.source("double").write_text(text.replace("return ", "return 0.0 * HUGE_VAL + "))
    assert not passes(built(made, "double", compiler, tmp_path))


def test_it_is_called_by_others_and_prints_what_is_wrong(
    compiler: Compiler, tmp_path: Path
) -> None:
    made = generate(LuGre(), tmp_path, real="float")
    main = tmp_path / "main.c"
    main.write_text("int lugre_f32_test(void);\nint main(void) { return lugre_f32_test(); }\n")
    text = made.source("float").read_text().replace("190.0f,", "191.0f,")
    made.source("float").write_text(text)
    flags = ("-DLUGRE_F32_TEST_NO_MAIN", "-DLUGRE_F32_TEST_PRINT", str(main))
    program = built(made, "float", compiler, tmp_path, *flags)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == int(sum(int(n) for n in re.findall(r": (\d+) wrong", done.stdout)))
    assert done.returncode > 0


def test_the_table_holds_the_same_rows_with_names_and_units(tmp_path: Path) -> None:
    generate(LuGre(), tmp_path, real="double")
    text = (tmp_path / "lugre_f64_vectors.csv").read_text()
    head, tolerance, *rows = csv.reader(text.splitlines())
    assert head[:5] == ["z before [m]", "v [m/s]", "N [N]", "changed parameter", "its value"]
    assert head[5:] == [
        "z after [m]", "F [N]", "F_end [N]", "z by init_sliding [m]", "status"
    ]  # fmt: skip
    assert float(tolerance[6]) > 0
    text = (tmp_path / "lugre_f64_vectors.h").read_text()
    assert f"#define LUGRE_F64_VECTORS {len(rows)}\n" in text
    assert any(row[3] == "sigma_1" and float(row[4]) == 237.5 for row in rows)
    assert all(len(row) == len(head) for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if name not in NO_STEP])
def test_the_kit_of_every_law_passes(name: str, compiler: Compiler, tmp_path: Path) -> None:
    made = generate(CASES[name], tmp_path)
    for real in made.reals:
        assert passes(built(made, real, compiler, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
@pytest.mark.parametrize("name", [name for name in ALL_SCENES if name != "arm"])
def test_the_kit_of_every_scene_passes(
    name: str, law: LuGre, compiler: Compiler, tmp_path: Path
) -> None:
    made = generate(plant_block(ALL_SCENES[name](law)), tmp_path)
    for real in made.reals:
        assert passes(built(made, real, compiler, tmp_path))
