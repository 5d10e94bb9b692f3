"""Files are written whole or not at all; columns of CSV files.

Finding a C compiler, and stopping one that does not come to an end.

Packages have the public names that type checkers see, and import them on first use.
"""

import ast
import importlib
import inspect
import os
import pickle
import subprocess
import sys
from contextlib import suppress
from errno import ENOSPC
from pathlib import Path
from re import escape
from time import sleep

import pytest

import symfric
from symfric.cli.app import COMMANDS, MODULES
from symfric.foundation import programs
from symfric.foundation.files import read_json, write_text, written
from symfric.foundation.programs import CompileError, Compiler, find_compiler, needed_compiler


def test_text_is_replaced_and_a_reader_of_the_old_file_sees_it_whole(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "a.txt"
    write_text(target, "µ one")
    with target.open(encoding="utf-8") as reader:
        write_text(str(target), "µ two and more")
        assert reader.read() == "µ one"
    assert target.read_text(encoding="utf-8") == "µ two and more"
    assert [p.name for p in target.parent.iterdir()] == ["a.txt"]


def test_error_half_way_keeps_the_old_file_and_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.csv"
    for old in ([], ["old"]):
        for error in (RuntimeError, KeyboardInterrupt):
            for text in old:
                target.write_text(text)
            with pytest.raises(error), written(target) as temporary:
                assert (temporary.suffix, temporary.parent) == (".csv", tmp_path)
                temporary.write_text("half")
                raise error
            assert [path.read_text() for path in tmp_path.iterdir()] == old


def test_mode_is_that_of_an_ordinary_new_file_and_a_link_stays_one(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "")
    (tmp_path / "b.txt").touch()
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "b.txt").stat().st_mode
    (tmp_path / "link.txt").symlink_to(tmp_path / "a.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "a.txt").read_text() == "new"


def test_places_that_hold_no_file_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").write_text("")
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    circle = r"output '.*': expected a .*, got (a circle|too many)"
    missing = Path(f"/none-{os.getpid()}")  # of this run alone: a defect may make it
    for place, message in (
        (".", r"output '.*': expected a file name, got a folder"),
        ("pipe", "expected a file name, got a device"),
        ("file/below.txt", r"expected a folder, got (the file|not a dir)"),
        ("a" * 300, "expected a file name, got file name too long"),
        ("a", circle), ("a/c.txt", circle),
        (missing / "below" / "x.png", "expected a folder that exists, got none named '/none-"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            write_text(tmp_path / place, "")
    assert (tmp_path / "pipe").is_fifo()
    assert not missing.exists()


def test_a_full_disk_is_reported_and_leaves_no_file(tmp_path: Path) -> None:
    message = r"output '.*a.txt': expected space on the disk, got no space"
    with pytest.raises(ValueError, match=message), written(tmp_path / "a.txt"):
        raise OSError(ENOSPC, os.strerror(ENOSPC))
    assert list(tmp_path.iterdir()) == []


def test_json_of_a_file_is_an_object(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for text in ("{", "[1]", "[" * 100_000, "\ud800".encode(errors="surrogatepass"), "1"):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(ValueError, match=r"case '.*a.json': expected a case, got something e"):
            read_json("case", path, "a case")
    path.write_text('{"a": 1}')
    assert read_json("case", path, "a case") == {"a": 1}
    with pytest.raises(ValueError, match="got no such file"):
        read_json("case", tmp_path / "none.json", "a case")


needs_shell = pytest.mark.skipif(sys.platform == "win32", reason="shell scripts as compilers")


def script(path: Path, text: str) -> Compiler:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return Compiler((str(path),))


def test_without_any_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    assert find_compiler() is None
    with pytest.raises(CompileError, match="found none; install one, or pass backend='vm'"):
        needed_compiler()


def test_cc_comes_first_with_its_options_and_is_looked_at_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in ("whatever", "other"):
        monkeypatch.setenv("CC", f"{sys.executable} -m {module}")
        assert find_compiler() == Compiler((sys.executable, "-m", module))


@needs_shell
def test_without_cc_the_first_that_is_there_is_taken(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "  ")
    for name in ("cc", "clang", "gcc"):
        script(tmp_path / name, "")
        assert find_compiler() == Compiler((str(tmp_path / name),))
    monkeypatch.delenv("CC")
    assert find_compiler() == Compiler((str(tmp_path / "gcc"),))


def test_a_compiler_that_is_named_must_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    for wanted in ("no-such-compiler -O3", "/no/such/compiler", "'half a quotation"):
        monkeypatch.setenv("CC", wanted)
        assert find_compiler() is None
        with pytest.raises(CompileError, match=escape(f"$CC is {wanted!r}, which is not found")):
            needed_compiler()
    with pytest.raises(ValueError, match="expected a C compiler, got 'no-such-compiler'"):
        find_compiler("no-such-compiler")


@needs_shell
def test_output_is_returned_and_failure_is_an_error(tmp_path: Path) -> None:
    reported = script(tmp_path / "a", 'echo "$1 $EXTRA $(cat)" >&2').run(
        "-c", code="int x;", variables={"EXTRA": "more"}
    )
    assert reported.strip() == "-c more int x;"
    with pytest.raises(CompileError, match="failed with status 3:\nno licence"):
        script(tmp_path / "b", "echo no licence >&2; exit 3").run()
    broken = script(tmp_path / "c", "")
    (tmp_path / "c").write_bytes(b"\x00")
    with pytest.raises(CompileError, match="does not start: Exec format error"):
        broken.run()


@needs_shell
def test_one_that_hangs_is_stopped_with_what_it_started(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """4f644ad waited for ever, as it did for a child that kept its output open."""
    monkeypatch.setattr(programs, "PATIENCE", 2.0)  # in which a busy machine has started the child
    hanging = script(tmp_path / "hanging", f"sleep 60 & echo $! > {tmp_path / 'child'}; wait")
    with pytest.raises(CompileError, match="hanging did not end within 2 s"):
        hanging.run()
    state = Path(f"/proc/{int((tmp_path / 'child').read_text())}/stat")
    for _ in range(100):  # a signal is sent at once and carried out soon
        if not alive(state):
            break
        sleep(0.05)
    assert not alive(state)


def alive(state: Path) -> bool:
    """Whether a process runs or sleeps, given its file in /proc."""
    with suppress(FileNotFoundError, ProcessLookupError):
        return state.read_text().rpartition(")")[2].split()[0] not in "ZX"
    return False


@needs_shell
def test_an_interrupt_stops_it_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    waiting = script(tmp_path / "waiting", f"echo $$ > {tmp_path / 'pid'}; exec sleep 60")
    monkeypatch.setattr(programs.subprocess.Popen, "communicate", interrupted)
    started: list[int] = []
    end = programs.end
    monkeypatch.setattr(
        programs, "end", lambda process: (started.append(process.pid), end(process))
    )
    with pytest.raises(KeyboardInterrupt):
        waiting.run()
    with pytest.raises(ProcessLookupError):
        os.kill(started[0], 0)


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
        pytest.param("import symfric.cli.codegen", ("matplotlib",), marks=pytest.mark.slow),
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
