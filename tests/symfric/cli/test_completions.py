"""What the shell completes."""

import pytest

from symfric.cli import completions, main
from symfric.laws import ALL_LAWS
from symfric.scenes import ALL_SCENES

COMPLETED = {
    "symfric ru": ["run"],
    "symfric run rabin": ["rabinowicz"],
    "symfric run drive --law lugre_n": ["lugre_normalised"],
    "symfric run drive --law coulomb+visc": ["coulomb+viscous"],
    "symfric run rabinowicz --law dahl --set v_b": ["v_belt="],
    "symfric laws gms --set fo": ["form="],
    "symfric laws lugre --figure hyst": ["hysteresis"],
    "symfric laws lugre --compare random_": ["random_bristles"],
    "symfric identify a.csv --law dahl,gm": ["dahl,gms"],
    "symfric run rabinowicz --law dahl --preset jing": ["jing_mi_table_3"],
    "symfric run pendulum_box --law dahl --law-of hi": ["hinge="],
    "symfric ocp swing_up_of_nothing": [],
    "symfric bench iv": ["ivp"],
    "symfric select drive --need stiction,strib": ["stiction,stribeck"],
    "symfric gallery self": ["self_tuning/"],
}


@pytest.mark.parametrize("words", COMPLETED)
def test_words_are_completed(
    words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_SYMFRIC_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    with pytest.raises(SystemExit, match="0"):  # the shell is answered at once
        main([])
    assert capsys.readouterr().out.split() == COMPLETED[words]


def test_all_names_are_offered() -> None:
    assert completions.laws("") == [*ALL_LAWS]
    assert completions.scenes("") == [*ALL_SCENES]
    assert completions.laws("lagged(stri") == ["lagged(stribeck"]
