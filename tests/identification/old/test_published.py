import pytest

from identification.old.published import EMPS, Published


@pytest.mark.parametrize("model", EMPS, ids=lambda model: model.name)
def test_published_values_are_plausible(model: Published) -> None:
    assert model.parameters["m"][0] == pytest.approx(95.1, abs=0.1)
    assert all(error > 0 for _, error in model.parameters.values())
    assert model.force_relative[0] < model.force_relative[1]
