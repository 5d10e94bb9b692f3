import numpy as np
import pytest
from discretised import EFFORT, mean_of_scenarios, stage

from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.transcription.schemes import check_meshes, join, make_mesh, make_meshes, nodes_of, split

ONE = Problem(Phase(stage(), 1.0, via={0.5: {"x": 0.5}, 0.3: {"x": 0.2}}), EFFORT)
TWO = Problem(Phase(stage(), 1.0, end={"x": 1.0}) >> Phase(stage(), 1.0), EFFORT)
SPAN = ONE.spans[0]


def test_via_points_become_nodes() -> None:
    np.testing.assert_allclose(make_mesh(SPAN, 4), [0, 0.25, 0.3, 0.5, 0.75, 1])
    np.testing.assert_allclose(make_mesh(SPAN, [0, 0.4, 1]), [0, 0.3, 0.4, 0.5, 1])


def test_meshes_are_numbers_or_fractions_for_all_phases_or_each() -> None:
    assert [mesh.size for mesh in make_meshes(TWO, 3)] == [4, 4]
    assert [mesh.size for mesh in make_meshes(TWO, [3, 5])] == [4, 6]
    assert [mesh.size for mesh in make_meshes(TWO, [0, 0.2, 1])] == [3, 3]
    assert [mesh.size for mesh in make_meshes(TWO, [[0, 0.2, 1], 4])] == [3, 5]
    assert len(make_meshes(mean_of_scenarios(), 3)) == 4


@pytest.mark.parametrize(
    "intervals", [0, -3, 2.5, True, "3", [0.0], [0, 0.5], [0.1, 1.0], [0, 0.6, 0.5, 1], [[0, 1]]]
)
def test_impossible_meshes_are_refused(intervals: object) -> None:
    with pytest.raises(ValueError, match="intervals: expected"):
        make_meshes(TWO, intervals)


def test_meshes_fit_the_spans() -> None:
    with pytest.raises(ValueError, match=r"expected a node at 0\.3"):
        nodes_of(SPAN, np.array([0.0, 0.5, 1.0]))
    with pytest.raises(ValueError, match=r"meshes: expected 2, one for each phase, .* got 3"):
        check_meshes(TWO, [np.array([0.0, 1.0])] * 3)
    for wrong in ([0.0, 0.6, 0.5, 1.0], [0.0, 0.9], []):
        with pytest.raises(ValueError, match=r"increasing fractions|got none"):
            check_meshes(ONE, [np.array(wrong)])


def test_split_and_join_undo_each_other() -> None:
    mesh = np.array([0.0, 0.2, 1.0])
    fine = split(mesh, [1, 4])
    np.testing.assert_allclose(fine, [0, 0.2, 0.4, 0.6, 0.8, 1])
    np.testing.assert_allclose(join(fine, [2, 3, 4]), mesh)
    np.testing.assert_allclose(join(fine, range(6), keep=[0.6]), [0, 0.6, 1])
    with pytest.raises(ValueError, match="split: expected 2 numbers of parts"):
        split(mesh, [1, 2, 3])
