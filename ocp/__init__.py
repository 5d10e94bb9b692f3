"""Optimal control that lands where it says: phases, contact modes, verification, receding horizons.

`solve(Problem(Phase(model, T=1.0, end=...), cost))` is the whole of it; see `solve` for what is
done about friction.
"""

from ocp.checking.verification import Miss as Miss
from ocp.checking.verification import Verification as Verification
from ocp.checking.verify import verify as verify
from ocp.friction.event_check import set_valued as set_valued
from ocp.friction.event_check import verify_exactly as verify_exactly
from ocp.mpc.closed_loop import ClosedLoop as ClosedLoop
from ocp.mpc.closed_loop import plot_loops as plot_loops
from ocp.mpc.controller import Controller as Controller
from ocp.mpc.controller import controller_of as controller_of
from ocp.result.solution import Mode as Mode
from ocp.result.solution import Solution as Solution
from ocp.result.solution import load as load
from ocp.solve import solve as solve
from ocp.solvers.fatrop import Fatrop as Fatrop
from ocp.solvers.ipopt import Ipopt as Ipopt
from ocp.solvers.outcome import Progress as Progress
from ocp.solvers.outcome import SolverStatistics as SolverStatistics
from ocp.solvers.sqp import Sqp as Sqp
from ocp.solving.starts import Guess as Guess
from ocp.text.cost import TIME as TIME
from ocp.text.cost import Cost as Cost
from ocp.text.cost import at_end as at_end
from ocp.text.cost import effort as effort
from ocp.text.cost import integral as integral
from ocp.text.cost import track as track
from ocp.text.cost import worst as worst
from ocp.text.moves import rest_to_rest as rest_to_rest
from ocp.text.phase import Chain as Chain
from ocp.text.phase import Phase as Phase
from ocp.text.problem import Problem as Problem
from ocp.text.ranges import FREE as FREE
from ocp.text.ranges import Free as Free
from ocp.text.ranges import Range as Range
from ocp.text.signals import Signals as Signals
from ocp.transcription.schemes import Legendre as Legendre
from ocp.transcription.schemes import Radau as Radau
from ocp.transcription.schemes import Shooting as Shooting
