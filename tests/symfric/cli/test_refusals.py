"""Bad command lines: one sentence on standard error, status 2, no files, no defect."""

import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from fits import make
from robots import SMALL

from symfric.cli import main

TEXT = Path(__file__).with_name("refusals.toml").read_text(encoding="utf-8")
NUMBERS = ["abc", "nan", "-inf", "1,5"]
COUNTS = [*NUMBERS, "1.5", "1e12", "-1", "10000000000000000000000", "1e400"]
PAIRS = ["mu_d=", "=1", "nonsense=1", "mu_d=1=2", *(f"mu_d={x}" for x in NUMBERS[:5])]
LAWS = [
    "", " ", "+", "lugre)", "lagged()", "x" * 5000,
    "lagged(" * 500 + "lugre" + ")" * 500, "\x1b[31m", "../lugre", "%s",
]  # fmt: skip
FILES = ["/no-such-folder/x{}", "record.csv/x{}", ".", "loop/x{}", "a" * 300 + "{}"]
PICTURES = [f.format(".png") for f in FILES] + ["x", "x.xyz", ".png", "x.png.exe", ""]
TABLES = [f.format("") for f in FILES]
DATA = ["force=", "force=bytes.csv:force", "force=huge.csv:force", "force=long.csv:force",
        "force=loop.csv:x", "force=empty.csv:force", "force=.:x"]  # fmt: skip
GRID = {
    "run rabinowicz --law brown_mcphee --t-end 0.01": {
        "law": LAWS, "set": PAIRS, "x0": ["v=abc", "v=nan"], "t-end": [*NUMBERS, "0"],
        "rtol": [*NUMBERS, "0"], "samples": [*COUNTS, "0"], "max-step": [*NUMBERS, "-1"],
        "times": [*NUMBERS, "", ",", "2,1", "1,1"], "out": TABLES, "plot": PICTURES, "json": TABLES,
        "input": ["force=1", "force", "="], "animate": ["x", "x.png"], "method": ["", "AUTO"],
    },
    "run drive --law brown_mcphee --t-end 0.01": {"input": DATA},
    "run pendulum --law brown_mcphee": {"animate": ["x.mov", "/no-such-folder/x.gif", "."]},
    "laws lugre": {"figure": ["", "lagg"], "compare": LAWS, "normal-force": [*NUMBERS, "-1"]},
    "laws": {"": LAWS[2:]},
    "identify record.csv --law coulomb+viscous": {
        "law": [*LAWS, ","], "validate": ["none.csv", ".", "words.csv"], "column": ["x", "x="],
        "normal-force": [*NUMBERS, "0"], "fix": [*PAIRS, "m=abc"], "free": ["nonsense", ""],
        "unit": ["", "furlong", "x=furlong", "nonsense=m"], "step": [*NUMBERS, "0"],
        "noise": ["force", "force=0", "y=1"], "starts": COUNTS, "workers": COUNTS,
    },
    "identify --law coulomb": {
        "": [".", "x.txt", "bytes.csv", "huge.csv", "loop.csv", "damaged.mat", "x.xlsx", ""],
    },
    "codegen --law stribeck --out c": {
        "law": LAWS, "set": PAIRS, "step-size": [*NUMBERS, "0"], "name": ["a b", "1a", "for", ""],
        "free": ["nonsense", ""], "compiler": ["", "/dev/null", "'"],
    },
    "demo": {"out": ["/dev/null", "/no-such-folder/x"]},
}  # fmt: skip
"""Good line -> option -> bad values; "" for an argument."""


def lines() -> Iterator[tuple[list[str], str]]:
    """Bad lines, and a part of their sentences."""
    for command, refused in tomllib.loads(TEXT).items():
        for line, part in refused.items():
            yield shlex.split(f"{command} {line}"), part
    for good, options in GRID.items():
        for name, values in options.items():
            for value in values:
                yield [*good.split(), *([f"--{name}"] if name else []), value], ""
    for scene in ("", "Rabinowicz", ".urdf", "loop.urdf", "3"):
        yield ["run", scene, "--law", "lugre"], ""


def prepare(folder: Path) -> None:
    """Files that lines name, most of them broken."""
    rows = [f"{0.01 * k},{0.001 * k * k},{1 + k % 7}" for k in range(100)]
    texts = {
        "record.csv": "\n".join(["t [s],x [m],force [N]", *rows]),
        "twice.csv": "t [s],force [N],force [N]\n0,1,2\n1,1,2\n",
        "units.csv": "t [s],force [m]\n0,1\n1,2\n",
        "words.csv": "t [s],force [N]\n0,one\n1,two\n",
        "empty.csv": "",
        "header.csv": "t [s],x [m],force [N]\n",
        "back.csv": "t [s],x [m],force [N]\n1,1,1\n0,2,2\n",
        "huge.csv": f"t [s],force [N]\n0,{'1' * 200_000}\n",
        "long.csv": "t [s],force [N]\n0,1,5\n1,2,5\n",
        "broken.py": "a = 1\nb = a / 0\n",
        "syntax.py": "a = (\n",
        "laws.py": "from symfric import StaticLaw\nclass Branch(StaticLaw):\n"
        "    def force(self, v, N, z=()): return N if v > 0 else -N\nnumber = 3\n",
        "robot.urdf": SMALL,
        "damaged.urdf": "<robot>",
        "axis.urdf": SMALL.replace("0 1 0", "0 1"),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    make(records=1, starts=1, n=200).to_json(folder / "fit.json")
    (folder / "bytes.csv").write_bytes(bytes(range(256)))
    (folder / "damaged.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(range(200)))
    for name in ("loop", "loop.csv", "loop.urdf"):
        (folder / name).symlink_to(folder / name)


def verdict(line: list[str], part: str, capsys: pytest.CaptureFixture[str]) -> str:
    """ "" for one sentence that holds `part` and status 2, else what is wrong with it."""
    try:
        status = main(line)
    except Exception as error:  # noqa: BLE001  (whatever comes is the finding)
        return f"{type(error).__name__}: {str(error)[:150]}"
    out, err = capsys.readouterr()
    reasons = [text for text in err.splitlines() if not text.startswith("symfric: warning:")]
    if status != 2:
        return f"status {status}: {err[:150]}"
    if (
        out
        or len(reasons) != 1
        or not reasons[0].startswith("symfric: ")
        or "internal error" in err
    ):
        return f"printed: {out[:80]!r}, {err[:150]!r}"
    if part not in err:
        return f"no {part!r} in {err!r}"
    return "" if len(reasons[0]) < 700 and ".cpp" not in err else f"long: {err[:150]!r}"


def test_every_bad_line_is_one_sentence_and_status_2(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = mine.parent
    prepare(folder)
    before = sorted(path.name for path in folder.iterdir())
    capsys.readouterr()
    wrong = [
        f"{' '.join(word[:40] or repr(word) for word in line)}: {fault}"
        for line, part in lines()
        if (fault := verdict(line, part, capsys))
    ]
    assert not wrong, f"{len(wrong)} of {len(list(lines()))}:\n" + "\n".join(wrong)
    assert sorted(path.name for path in folder.iterdir()) == before
