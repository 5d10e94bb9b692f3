"""Statuses carry the sentence that the user reads."""

import pytest

from symfric import SolveError, Status


@pytest.mark.parametrize("status", Status)
def test_value_is_a_sentence(status: Status) -> None:
    assert status.value[0].isupper()
    assert status.value.endswith(".")
    assert len(status.value) < 160


def test_interruption_is_said_of_runs_and_fits_alike() -> None:
    assert "time" not in Status.INTERRUPTED.value


def test_results_that_met_their_tolerances_can_be_used() -> None:
    assert {Status.SUCCESS, Status.SOLVED, Status.ACCEPTABLE} <= {s for s in Status if s.ok}


@pytest.mark.parametrize(
    "status",
    [
        Status.INTERRUPTED,
        Status.MAX_STEPS,
        Status.STEP_TOO_SMALL,
        Status.NOT_FINITE,
        Status.SINGULAR,
        Status.SOLVER_FAILED,
        Status.INFEASIBLE,
        Status.MAX_ITERATIONS,
        Status.TIME_LIMIT,
        Status.NO_STEP,
        Status.UNBOUNDED,
        Status.NO_DESCENT,
        Status.IMPLAUSIBLE,
        Status.TERMINAL_MISS,
    ],
)
def test_failures_cannot(status: Status) -> None:
    assert not status.ok


def test_error_carries_message_status_and_what_there_is_so_far() -> None:
    error = SolveError("stopped after t = 1 s", Status.NOT_FINITE, partial=[1, 2])
    assert str(error) == "stopped after t = 1 s"
    assert (error.status, error.partial) == (Status.NOT_FINITE, [1, 2])
    assert isinstance(error, RuntimeError)
    assert SolveError("x", Status.SINGULAR).partial is None
