"""Laws of the gallery keep their look."""

import pytest

from symfric.gallery.shared import LOOKS, look
from symfric.laws import ALL_LAWS, POPULATIONS

TOGETHER = (
    ("brown_mcphee", "threlfall", "bengisu_akay", "karnopp", "velocity_based", "awrejcewicz",
     "dahl", "lugre", "elasto_plastic", "stick_slip", "gonthier"),
    ("generic_asperity", "gms", "leuven", "maxwell_slip", "lugre", "elasto_plastic", "dahl"),
)  # fmt: skip
"""The laws of two papers, which stand in one picture."""


@pytest.mark.parametrize("laws", TOGETHER)
def test_laws_of_one_picture_look_different(laws: tuple[str, ...]) -> None:
    assert len({str(look(law)) for law in laws}) == len(laws)


def test_names_are_those_of_the_catalogue() -> None:
    assert {*LOOKS} <= {*ALL_LAWS, *POPULATIONS}
    with pytest.raises(ValueError, match="did you mean lugre"):
        look("lugr")
