"""Laws that `symfric select --data` fits, and what it hands over of them."""

from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from symfric.cli import select as command
from symfric.cli.app import main
from symfric.laws import BrownMcPhee, Law, LuGre


def test_laws_that_lack_what_is_needed_are_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[str]()

    def stop(laws: dict[str, Law], *_: object) -> None:
        asked.extend(laws)
        raise ValueError("enough")

    monkeypatch.setattr(command, "fitted", stop)
    line = "select drive --law dahl --law lugre --law coulomb --need presliding,stribeck --data d"
    assert main(line.split()) == 2
    assert asked == ["lugre"]


def test_fits_are_handed_over_with_their_errors_as_shares(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    law = LuGre(mu_s=0.2)
    rows = [
        SimpleNamespace(law="lugre", fit=SimpleNamespace(law=law), fitted=2.5, sentence=""),
        SimpleNamespace(law="dahl", fit=None, fitted=1.0, sentence="no motion"),
    ]
    fits = import_module("identification.select")  # the module, not the function of its name
    monkeypatch.setattr(fits, "select", lambda *_, **__: SimpleNamespace(rows=rows))  # pyright: ignore
    monkeypatch.setattr(command, "residuals_of", lambda *_: None)  # pyright: ignore
    read: Any = SimpleNamespace(read=lambda _: None)  # pyright: ignore
    given: dict[str, Law] = {"lugre": LuGre(), "dahl": BrownMcPhee()}
    held, misfits = command.fitted(given, read, [str(tmp_path)], "inverse", 1.0)
    assert held == {"lugre": law}
    assert misfits == {"lugre": 0.025}
    assert "dahl: no motion" in capsys.readouterr().err
    rows.pop(0)
    with pytest.raises(ValueError, match="--data: expected data that some law fits"):
        command.fitted(given, read, [], "inverse", 1.0)
