"""`symfric gallery`, `stress`, `bench` and `demo`: what they print, write and refuse."""

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from matplotlib.figure import Figure

from symfric.cli import campaigns, demo, main
from symfric.gallery import rendering
from symfric.gallery.rendering import Gallery
from symfric.stress import Case, Judgement, Report, draw
from symfric.stress.judge import CLASSES

PNG = b"\x89PNG"
SHORT: dict[str, Any] = {"speeds": (0.002, 0.02, 0.1)}
NAME = "self_tuning/fig_07_shape_factor"


def test_the_gallery_lists_its_figures_by_paper(symfric) -> None:
    out = symfric("gallery --list").out
    assert "self_tuning/fig_07" in out
    assert "10.1177/14644193231169325" in out


def test_failed_figures_are_reported(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    record = {"paper": "A and B, Title", "compared": "", "how_far": "2e-9 m", "seconds": 1.5}
    texts = ("This with that. More.", "word " * 30, "One. Two.", "0.5 mm ... 2 only.")
    for text, shown in zip(
        texts, ("This with that", "word ...", "One", "0.5 mm ... 2 only"), strict=True
    ):
        records = {NAME: record | {"compared": text}}
        for requested, status in ((("a", NAME), 1), (("a", NAME, "b"), 130)):
            done = Gallery(Path(), requested, records, {"a": "ValueError: none"}, 2.0)
            monkeypatch.setattr(rendering, "render", lambda *_, done=done, **__: done)
            printed = symfric("gallery --quick --out g", status)
            assert "a failed, ValueError: none" in printed.err
            assert ("1 of 3 figures were not computed" in printed.err) is (status == 130)
            assert f"1 of {len(requested)} figures in 2 s" in printed.err
            words = " ".join(printed.out.split())
            assert "self_tuning: A and B, Title" in words
            assert shown in words
            assert "More" not in words and "Two" not in words


@pytest.mark.slow
def test_a_campaign_prints_a_table_and_writes_json(symfric) -> None:
    out = symfric("stress --cases 2 --seed 3 --json stress.json --out cases").out
    data = json.loads(Path("stress.json").read_text())
    assert list(data["classes"]) == list(CLASSES)
    assert sum(data["classes"].values()) == 2
    assert all(name in out for name in CLASSES)
    assert not Path("cases").exists()
    Case(1, 1, "rabinowicz", "brown_mcphee", t_end=0.5).write(Path("case.json"))
    out = symfric("stress --case case.json").out
    assert "brown_mcphee in rabinowicz, rtol 1e-06, auto: right" in out


def test_a_failing_campaign_saves_its_cases(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    report = Report(1, 3, {0: Judgement("silent", "far off"), 1: Judgement("right")}, 1.0)
    monkeypatch.setattr("symfric.stress.campaign.campaign", lambda *_, **__: report)
    printed = symfric("stress --out .", 1)
    assert Case.read(Path("silent_1_0.json")) == draw(1, 0)
    assert "Interrupted: 1 of 3 cases were not run." in printed.out
    assert all(name in printed.out for name in CLASSES)
    assert "silent_1_0.json" in printed.err
    monkeypatch.setattr("symfric.stress.campaign.rerun", lambda *_: Judgement("silent", "far off"))
    printed = symfric("stress --case silent_1_0.json", 1)
    case = draw(1, 0)
    assert (
        f"{case.law} in {case.scene}, rtol {case.rtol:g}, {case.method}: silent. far" in printed.out
    )
    printed = symfric("stress --case silent_1_0.json --json -", 1)
    assert printed.json["verdict"]["kind"] == "silent"


def test_files_are_written_while_a_campaign_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that is switched off loses one minute of a long campaign."""

    def killed(*_: object, progress: Callable[[Report], None], **__: object) -> Report:
        progress(Report(1, 3, {0: Judgement("silent", "far off")}, 1.0))
        raise RuntimeError

    monkeypatch.setattr("symfric.stress.campaign.campaign", killed)
    monkeypatch.setattr("symfric.cli.campaigns.EVERY", -1.0)
    target = tmp_path / "stress.json"
    with pytest.raises(RuntimeError):
        main(["stress", "--json", str(target), "--out", str(tmp_path)])
    assert json.loads(target.read_text())["classes"]["silent"] == 1
    assert (tmp_path / "silent_1_0.json").exists()


def test_a_benchmark_is_printed_and_written(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    def measure(*given: Any, **how: Any) -> Any:
        seen.append((*given[:2], how))
        table = SimpleNamespace(head=["tool", "ratio"], rows=[("ours", 1.0)], title="Runs")
        return SimpleNamespace(
            plot=lambda path: path.write_text("p"), write_csv=lambda path: path.write_text("c"),
            to_dict=lambda: {"a": 1}, shown=lambda: [table, "A sentence."], interrupted=False,
            failed=failed,
        )  # fmt: skip

    seen: list[Any] = []
    failed: list[str] = []
    monkeypatch.setattr(campaigns, "measure", measure)
    printed = symfric(
        "bench multibody --quick --links 4,2,2 --plot b.png --csv b.csv --json b.json"
    )
    assert printed.err == "wrote b.png, b.csv, b.json\n"
    assert all(text in printed.out for text in ("Runs", "tool", "ours", "A sentence."))
    assert seen == [("multibody", True, {"links": (2, 4)})]
    assert (Path("b.png").read_text(), Path("b.csv").read_text()) == ("p", "c")
    failed.append("codegen")
    assert "Runs" in symfric("bench multibody --quick", 1).out


@pytest.mark.slow
def test_the_demo_runs_on_a_simulated_record(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    """README.md lists every file; the record has 28 N static, 20 N dynamic friction and 95 kg."""
    monkeypatch.setattr(demo, "INTERVALS", 12)
    monkeypatch.setattr(Figure, "savefig", lambda _, to, **__: Path(to).write_bytes(PNG))
    short = partial(demo.synthetic_drive_data, rate=500.0)
    monkeypatch.setattr(demo, "synthetic_drive_data", lambda **how: short(**SHORT | how))
    printed, out = symfric("demo"), Path("out")
    assert "no measured record found" in printed.err
    listed = set(re.findall(r"\]\(([^)]+)\)", (out / "README.md").read_text()))
    present = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert present == listed | {"README.md"}
    assert sum(name.endswith(".png") for name in present) == 5
    fit = json.loads((out / "identification" / "fit.json").read_text())["parameters"]
    for name, value in {"mu_s": 28.0, "mu_d": 20.0, "m": 95.0}.items():
        assert fit[name]["value"] == pytest.approx(value, rel=0.02)
    assert printed.out.count("  yes  ") == 2
    assert printed.out.count("verified (") == 2
