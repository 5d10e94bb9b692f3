"""Packages have the public names that type checkers see, and import them on first use."""

import ast
import importlib
import inspect
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import symfric
from symfric.cli.app import COMMANDS, MODULES

ROOT = Path(symfric.__file__).parents[1]
PACKAGES = [
    path for package in ("symfric", "ocp", "identification")
    for path in sorted((ROOT / package).rglob("__init__.py"))
    if "load_lazily(" in path.read_text("utf-8")
]  # fmt: skip
HEAVY = (
    "matplotlib", "scipy", "multiprocessing", "concurrent.futures", "numpy", "casadi", "csv",
    "symfric.laws.base", "symfric.multibody", "symfric.scenes", "symfric.integrator",
    "symfric.figures",
)  # fmt: skip


def fresh(code: str) -> str:
    """What a new interpreter prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_packages_show_the_names_that_checkers_see_and_no_other() -> None:
    for path in PACKAGES:
        (block,) = [n for n in ast.parse(path.read_text("utf-8")).body if isinstance(n, ast.If)]
        lines = [n for n in block.body if isinstance(n, ast.ImportFrom)]
        seen = {a.asname or a.name: str(line.module) for line in lines for a in line.names}
        if (whole := seen.pop("*", "")) != "":
            seen |= dict.fromkeys(importlib.import_module(whole).__all__, whole)
        package = importlib.import_module(".".join(path.parent.relative_to(ROOT).parts))
        for name, place in seen.items():
            assert getattr(package, name) is getattr(importlib.import_module(place), name), name
        assert [name for name in dir(package) if not name.startswith("__")] == sorted(seen)
        assert sorted(package.__all__) == sorted(seen)


def test_signatures_name_types_as_the_source_does() -> None:
    """`ArrayLike` is not expanded to the classes that it consists of."""
    seen = 0
    for path in PACKAGES:
        package = importlib.import_module(".".join(path.parent.relative_to(ROOT).parts))
        for public in (getattr(package, name) for name in package.__all__):
            own = vars(public).values() if inspect.isclass(public) else ()
            for call in (public, *filter(inspect.isfunction, own)):
                error = inspect.isclass(call) and issubclass(call, BaseException)
                if (inspect.isfunction(call) or inspect.isclass(call)) and not error:
                    seen += 1
                    assert "numpy._typing" not in str(inspect.signature(call)), call
    assert seen > 500


@pytest.mark.parametrize("call", ["import symfric", "import symfric.__main__, symfric.cli"])
def test_importing_loads_nothing_heavy(call: str) -> None:
    loaded = fresh(f"{call}\nimport sys; print(*sys.modules)").split()
    heavy = [name for name in HEAVY if name in loaded]
    assert not heavy
    assert len([name for name in loaded if name.startswith("symfric")]) <= 10


@pytest.mark.parametrize(
    ("code", "slow"),
    [
        ("import symfric.cli as c; c.main(['--version'])",
         ("casadi", "numpy", "symfric.cli.run", "symfric.laws.base")),
        # a package called as what it hands out, loaded before it, does not stand for it
        ("import symfric.integrator.simulate, symfric.scenes.blocks, symfric as sf;"
         "sf.integrator.simulate(sf.scenes.rabinowicz(sf.BrownMcPhee()), 0.1)",
         ("matplotlib", "scipy", "symfric.multibody", "symfric.figures", "concurrent.futures")),
        ("import symfric.cli.codegen", ("matplotlib",)),
    ],
    ids=["version", "belt", "C"],
)  # fmt: skip
def test_what_a_call_does_not_need_is_not_loaded(code: str, slow: tuple[str, ...]) -> None:
    loaded = fresh(f"{code}; import sys; print(*sys.modules)").splitlines()[-1].split()
    assert not [name for name in slow if name in loaded]


def test_names_pickle_star_and_rooms() -> None:
    everything: dict[str, object] = {}
    exec("from symfric import *", everything)
    assert everything["BrownMcPhee"] is symfric.BrownMcPhee
    assert set(symfric.__all__) <= set(everything)
    assert pickle.loads(pickle.dumps(symfric.simulate)) is symfric.simulate
    assert symfric.laws.LuGre is symfric.LuGre
    assert symfric.results.trajectory.Trajectory is symfric.Trajectory


def test_what_is_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'symfric' has no attribute 'LuGree'"):
        _ = symfric.LuGree
    assert not hasattr(symfric, "_nothing")
    with pytest.raises(ImportError, match="cannot import name 'simulat'"):
        exec("from symfric.integrator import simulat")


def test_the_list_of_commands_has_the_sentences_of_the_commands() -> None:
    for name, line in COMMANDS.items():
        own = name.replace("-", "_")
        function = getattr(importlib.import_module(f"symfric.cli.{MODULES.get(own, own)}"), own)
        assert (function.__doc__ or "").splitlines()[0] == line
