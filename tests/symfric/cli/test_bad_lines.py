"""Bad command lines: one sentence on standard error, the right status, no files, no defect."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from symfric.cli import main

RUN = "run rabinowicz --law brown_mcphee --t-end 0.01 --backend vm"
DRIVE = "run drive --law brown_mcphee --t-end 0.01 --backend vm"
PENDULUM = "run pendulum --law brown_mcphee --t-end 0.01 --backend vm"
IDENTIFY = "identify record.csv --law coulomb+viscous"
CODEGEN = "codegen --law stribeck --out c"

NUMBERS = ["abc", "nan", "inf", "-inf", "1e400", "1,5", "0x10", "1+2j", "None", "[1]", "1 2", "٣x"]
COUNTS = [*NUMBERS, "1.5", "1e12", "-1", "10000000000000000000000"]
PAIRS = ["mu_d", "mu_d=", "=1", "=", "nonsense=1", "mu_d=1=2", *(f"mu_d={x}" for x in NUMBERS[:9])]
LAWS = [
    "",
    " ",
    "lugr",
    "coulomb+",
    "+",
    "lugre)",
    "lagged",
    "lagged()",
    "lugre(",
    "generic_asperity",
    "LuGre()",
    "x" * 5000,
    "lagged(" * 500 + "lugre" + ")" * 500,
    "[31m",
    "../lugre",
    "%s",
]
FILES = [
    "/a-folder-nobody-has/x{}",
    "record.csv/x{}",
    ".",
    "/dev/null",
    "loop/x{}",
    "a" * 300 + "{}",
]
PICTURES = [f.format(".png") for f in FILES] + ["x", "x.xyz", ".png", "x.png.exe", ""]
TABLES = [f.format("") for f in FILES] + [""]


def options(good: str, **bad: list[str]) -> Iterator[list[str]]:
    """The line `good` with each bad value of each option behind it, option by option."""
    for name, values in bad.items():
        for value in values:
            yield [*good.split(), f"--{name.replace('_', '-')}", value]


def lines() -> Iterator[list[str]]:
    for text in (
        "nonsense",
        "runn",
        "--nonsense",
        "-x",
        "run",
        "laws a b",
        "run a b --law lugre",
        "identify",
        "codegen",
        "codegen --law lugre",
        "run rabinowicz",
        "bench nonsense",
        "bench integrator --links 2",
        "bench multibody --links a",
        "demo --data none",
        "bench multibody --links 0",
        "bench regularisation --links 2",
        "demo extra",
        "laws --set mu_d=1",
        "laws --figure lag",
        "laws --compare lugre",
        "--version=3",
    ):
        yield text.split()
    for scene in (
        "",
        "rabinowitz",
        "Rabinowicz",
        "x.urdf",
        ".urdf",
        "record.urdf",
        "loop.urdf",
        "3",
    ):
        yield ["run", scene, "--law", "lugre"]
    yield from options(
        RUN,
        law=LAWS,
        set=PAIRS,
        x0=[*PAIRS, "v=abc", "v=nan"],
        t_end=[*NUMBERS, "0", "-1", "1e-400"],
        rtol=[*NUMBERS, "0", "-1e-6", "1"],
        method=["", "rodas", "euler", "backward_euler", "AUTO"],
        backend=["", "gpu", "ggl", "VM"],
        peer=["", "cvodes", "auto"],
        samples=[*COUNTS, "0", "1"],
        max_step=[*NUMBERS, "0", "-1"],
        times=[*NUMBERS[:4], "", ",", "2,1", "1,1", "-1"],
        out=TABLES,
        plot=PICTURES,
        json=TABLES[:-1],
        input=["force=1", "force", "=", "v_belt=1"],
        animate=["x", "x.png"],
        panels=["", "some", "Main"],
    )
    yield from options(
        DRIVE,
        input=[
            "force",
            "force=",
            "frc=1",
            "force=abc",
            "force=nan",
            "force=none.csv:u",
            "force=record.csv:",
            "force=record.csv:nonsense",
            "force=:x",
            "force=loop.csv:x",
            "force=twice.csv:force",
            "force=units.csv:force",
            "force=words.csv:force",
            "force=empty.csv:force",
            "force=back.csv:force",
            "force=bytes.csv:force",
            "force=huge.csv:force",
            "force=long.csv:force",
            "force=.:x",
            "force=header.csv:force",
        ],
        animate=["x.mov"],
        set=["m=0", "m=-1", "N=nan", "mu_d=5,5", "mu_d=2"],
    )
    yield [*DRIVE.split(), "--input", "force=1", "--input", "force=2"]
    yield [*DRIVE.split(), "--law", "brown_mcphee"]
    yield [*DRIVE.split(), "--law", "lugre", "--out", "x.csv"]
    yield from options(PENDULUM, animate=["x.mov", "x", "/a-folder-nobody-has/x.gif", "."])
    yield from options(
        "laws lugre",
        set=PAIRS[:6],
        plot=PICTURES,
        figure=["", "lagg", "nonsense"],
        compare=[x for x in LAWS if x != "generic_asperity"],
        normal_force=[*NUMBERS, "0", "-1"],
        json=TABLES[:-1],
    )
    for name in LAWS[2:]:
        if name != "generic_asperity":
            yield ["laws", name]
    yield from options(
        IDENTIFY,
        law=[*LAWS, "coulomb,", ",", "coulomb,coulomb"],
        validate=["none.csv", ".", "words.csv"],
        plot=PICTURES,
        normal_force=[*NUMBERS, "0", "-1"],
        column=["x", "x=", "x=nonsense"],
        fix=[*PAIRS, "m=abc"],
        free=["nonsense", ""],
        kind=["", "point", "Points"],
        windows=[*NUMBERS, "choose"],
        unit=["", "furlong", "x=furlong", "x=", "nonsense=m"],
        step=[*NUMBERS, "0", "-1"],
        noise=["force", "force=0", "y=1", *(f"force={x}" for x in NUMBERS[:5])],
        loss=["", "cubes"],
        starts=[*COUNTS, "0"],
        jobs=[*COUNTS, "0"],
        profile=["", "nonsense"],
        report=TABLES,
        json=TABLES[:-1],
    )
    for name in (
        "none.csv",
        ".",
        "x.txt",
        "words.csv",
        "empty.csv",
        "bytes.csv",
        "huge.csv",
        "loop.csv",
        "damaged.mat",
        "back.csv",
        "header.csv",
        "x.xlsx",
        "",
    ):
        yield ["identify", name, "--law", "coulomb"]
    yield from options(
        CODEGEN,
        law=LAWS[:9],
        set=PAIRS[:6],
        scene=["", "belt", "x.urdf"],
        method=["rodas3", "x"],
        real=["", "half", "f64"],
        step_size=[*NUMBERS, "0", "-1"],
        name=["a b", "1a", "for", "", "a-b"],
        free=["nonsense", ""],
        compiler=["", "none", "/dev/null", "'"],
        out=FILES[:1],
        json=TABLES[:-1],
    )
    yield from options(f"{CODEGEN} --scene drive", method=["", "euler"], free=["nonsense"])
    yield from options("bench", plot=PICTURES[:3], json=TABLES[:2])
    yield from options("demo", out=["record.csv", "/dev/null", "/a-folder-nobody-has/x"])


def prepare(folder: Path) -> None:
    """Files that lines name, most of them broken."""
    rows = [f"{0.01 * k},{0.001 * k * k},{1 + k % 7}" for k in range(100)]
    (folder / "record.csv").write_text("\n".join(["t [s],x [m],force [N]", *rows]))
    texts = {
        "twice": "t [s],force [N],force [N]\n0,1,2\n1,1,2\n",
        "units": "t [s],force [m]\n0,1\n1,2\n",
        "words": "t [s],force [N]\n0,one\n1,two\n",
        "empty": "",
        "header": "t [s],x [m],force [N]\n",
        "back": "t [s],x [m],force [N]\n1,1,1\n0,2,2\n",
        "huge": f"t [s],force [N]\n0,{'1' * 200_000}\n",
        "long": "t [s],force [N]\n0,1,5\n1,2,5\n",
    }
    for name, text in texts.items():
        (folder / f"{name}.csv").write_text(text)
    (folder / "bytes.csv").write_bytes(bytes(range(256)))
    (folder / "damaged.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(range(200)))
    (folder / "record.urdf").write_text("<robot")
    for name in ("loop", "loop.csv", "loop.urdf"):
        (folder / name).symlink_to(folder / name)


def verdict(line: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """ "" for one sentence and status 2, else what is wrong with it."""
    try:
        status = main(line)
    except Exception as error:  # noqa: BLE001  (whatever comes is the finding)
        return f"{type(error).__name__}: {str(error)[:150]}"
    out, err = capsys.readouterr()
    told = [text for text in err.splitlines() if not text.startswith("symfric: warning:")]
    if status != 2:
        return f"status {status}: {err[:150]}"
    if out or len(told) != 1 or not told[0].startswith("symfric: ") or "internal error" in err:
        return f"said: {out[:80]!r}, {err[:150]!r}"
    return "" if len(told[0]) < 700 and ".cpp" not in err else f"long: {err[:150]!r}"


def test_every_bad_line_is_one_sentence_and_status_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    prepare(tmp_path)
    before = sorted(path.name for path in tmp_path.iterdir())
    tried = list(lines())
    assert len(tried) >= 300
    capsys.readouterr()
    found = [(" ".join(map(_short, line)), verdict(line, capsys)) for line in tried]
    wrong = [f"{line}: {said}" for line, said in found if said]
    assert not wrong, f"{len(wrong)} of {len(tried)}:\n" + "\n".join(wrong)
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def _short(word: str) -> str:
    return repr(word[:40]) if len(word) > 40 or " " in word or not word else word


@pytest.mark.parametrize(
    "setting",
    [("CC", "/nonexistent/cc"), ("CC", "'"), ("CC", "false"), ("SYMFRIC_CACHE", "record.csv")],
    ids=str,
)
def test_a_compiler_that_cannot_be_used_is_one_sentence(
    setting: tuple[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`run --backend compiled` called all of these an internal error to be reported."""
    monkeypatch.chdir(tmp_path)
    prepare(tmp_path)
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv(*setting)
    line = "run rabinowicz --law coulomb --t-end 0.01 --backend compiled"
    assert verdict(line.split(), capsys) == ""
