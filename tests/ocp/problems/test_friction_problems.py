import pytest

from ocp.problems import FRICTION, Ready
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise


@pytest.mark.parametrize("ready", FRICTION, ids=lambda ready: ready.name)
def test_a_ready_problem_has_contacts_and_a_program(ready: Ready) -> None:
    problem = ready.make(v_t=1e-3)
    contacts = {c.name: c for span in problem.spans for c in span.model.contacts}
    assert {c.law.velocity_scale for c in contacts.values()} == {1e-3}
    program = discretise(problem, Radau(3)).on(make_meshes(problem, 4)).program
    assert program.w.numel() == program.lower_w.size
