"""What a notebook shows of fits and rankings."""

from identification import Dataset, Fit, InverseDynamics, select, synthetic_drive_data


def test_a_fit_shows_verdict_intervals_and_picture() -> None:
    fit = Fit(InverseDynamics(), "stribeck", synthetic_drive_data(seed=1)).solve()
    page = fit._repr_html_()
    assert page.count("data:image/png;base64,") == 1
    assert "SOLVED" in page
    for name in fit.names:
        assert f">{name}<" in page
        assert f">{fit.parameters[name].low:.6g}<" in page


def test_a_ranking_shows_every_law_and_why_one_was_not_fitted() -> None:
    data: Dataset = synthetic_drive_data(seed=1)
    ranking = select({"stribeck": "stribeck", "<odd>": "karnopp"}, data, folds=0)
    page = ranking._repr_html_()
    assert ">stribeck<" in page and "&lt;odd&gt;" in page and "<odd>" not in page
    assert page.count("<tr>") == 3
