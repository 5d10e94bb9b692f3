"""A law by modes is replaced by models of its modes; nobody solves it as if nothing happened."""

import pytest

from ocp.formulation.problem import rest_to_rest
from ocp.solve import solve
from ocp.transcription.schemes import Shooting
from symfric import ExactCoulomb, drive


def test_laws_by_modes_are_not_solved_as_they_are() -> None:
    move = rest_to_rest(drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0), 1.0, 1.0, limit=20.0)
    for way in ({"friction": "smooth"}, {"scheme": Shooting()}):
        with pytest.raises(ValueError, match=r"expected models without events, got .*modes"):
            solve(move, **way)
