import numpy as np
import pytest

from identification.unknowns.unknown import Unknown
from identification.unknowns.unknowns import unknowns_of


def test_a_logarithmic_value_that_wants_to_be_nothing_is_at_its_bound() -> None:
    both = (Unknown("b", "1", 0.05, 0.0, logarithmic=True), Unknown("c", "1", 0.05))
    made = unknowns_of(both, {}, ("b", "c"))
    gone = np.array([-700.0, 0.0])
    assert made.at_bound(gone).tolist() == [True, False]
    there = np.maximum(gone, made.floor)
    assert made.values(there)[0] == pytest.approx(0.05e-12)
    assert np.linalg.det(made.slope(there)) > 0
    assert not made.at_bound(made.start).any()
