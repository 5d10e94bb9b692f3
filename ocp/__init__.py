"""Optimal control of any explicit `Model`: Radau collocation, Ipopt, and a check by simulation."""

from ocp.cost import TIME as TIME
from ocp.cost import Cost as Cost
from ocp.cost import Signals as Signals
from ocp.cost import at_end as at_end
from ocp.cost import integral as integral
from ocp.guess import Guess as Guess
from ocp.ipopt import Progress as Progress
from ocp.ipopt import SolverStatistics as SolverStatistics
from ocp.moves import rest_to_rest as rest_to_rest
from ocp.problem import FREE as FREE
from ocp.problem import Free as Free
from ocp.problem import Problem as Problem
from ocp.problem import Range as Range
from ocp.solution import Solution as Solution
from ocp.solve import solve as solve
