"""Optimal control with friction: phases, contact modes, verification, predictive controllers.

A complete call is `solve(Problem(Phase(model, T=1.0, end=...), cost))`. The documentation of
`solve` describes how friction is treated.
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from ocp.checking.verify import verify as verify
    from ocp.estimation import Estimate as Estimate
    from ocp.estimation import estimate as estimate
    from ocp.formulation.changed_models import Polynomial as Polynomial
    from ocp.formulation.expressions import TIME as TIME
    from ocp.formulation.expressions import Cost as Cost
    from ocp.formulation.expressions import Signals as Signals
    from ocp.formulation.expressions import absolute as absolute
    from ocp.formulation.expressions import at_end as at_end
    from ocp.formulation.expressions import effort as effort
    from ocp.formulation.expressions import integral as integral
    from ocp.formulation.expressions import largest as largest
    from ocp.formulation.expressions import track as track
    from ocp.formulation.expressions import worst as worst
    from ocp.formulation.phase import FREE as FREE
    from ocp.formulation.phase import Chain as Chain
    from ocp.formulation.phase import Free as Free
    from ocp.formulation.phase import Phase as Phase
    from ocp.formulation.phase import Range as Range
    from ocp.formulation.problem import Problem as Problem
    from ocp.formulation.problem import rest_to_rest as rest_to_rest
    from ocp.formulation.statement import complementary as complementary
    from ocp.formulation.statement import soft as soft
    from ocp.friction.event_check import set_valued as set_valued
    from ocp.friction.event_check import verify_exactly as verify_exactly
    from ocp.mpc.closed_loop import ClosedLoopRun as ClosedLoopRun
    from ocp.mpc.closed_loop import plot_loops as plot_loops
    from ocp.mpc.controller import Controller as Controller
    from ocp.mpc.controller import controller_of as controller_of
    from ocp.mpc.target import measure_controller as measure_controller
    from ocp.solve import solve as solve
    from ocp.solving.active import Active as Active
    from ocp.solving.active import Condition as Condition
    from ocp.solving.active import Sensitivity as Sensitivity
    from ocp.solving.methods import Fatrop as Fatrop
    from ocp.solving.methods import Ipopt as Ipopt
    from ocp.solving.methods import Sqp as Sqp
    from ocp.solving.nlp import Nlp as Nlp
    from ocp.solving.nlp import nlp_of as nlp_of
    from ocp.solving.picture import LivePlot as LivePlot
    from ocp.solving.picture import plot_solutions as plot_solutions
    from ocp.solving.solution import Mode as Mode
    from ocp.solving.solution import Solution as Solution
    from ocp.solving.solution import load as load
    from ocp.solving.starts import Guess as Guess
    from ocp.solving.verification import Miss as Miss
    from ocp.solving.verification import Verification as Verification
    from ocp.solving.watch import Progress as Progress
    from ocp.transcription.program import SolverStatistics as SolverStatistics
    from ocp.transcription.schemes import Legendre as Legendre
    from ocp.transcription.schemes import Radau as Radau
    from ocp.transcription.schemes import Shooting as Shooting

load_lazily(__name__)
