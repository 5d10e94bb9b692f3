"""Statuses carry the sentence that the user reads."""

from symfric import SolveError, Status


def test_values_are_sentences() -> None:
    for status in Status:
        assert status.value[0].isupper() and status.value.endswith(".") and len(status.value) < 160


def test_results_that_met_their_tolerances_can_be_used_and_no_others() -> None:
    good = {"SUCCESS", "TERMINATED", "SOLVED", "ACCEPTABLE", "DOUBTFUL"}
    assert {status.name for status in Status if status.ok} == good
    assert "time" not in Status.INTERRUPTED.value  # also said of fits


def test_error_carries_message_status_and_what_there_is_so_far() -> None:
    error = SolveError("stopped after t = 1 s", Status.NOT_FINITE, partial=[1, 2])
    assert str(error) == "stopped after t = 1 s"
    assert (error.status, error.partial) == (Status.NOT_FINITE, [1, 2])
    assert isinstance(error, RuntimeError)
    assert SolveError("x", Status.SINGULAR).partial is None
