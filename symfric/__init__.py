"""Friction laws as CasADi expressions, from simulation to optimal control and embedded C.

    from symfric import LuGre, rabinowicz, simulate

    run = simulate(rabinowicz(LuGre()), 20.0)
    print(run)  # every signal with its unit and extremes
    run.plot()
    run.save("run.npz")

Contents; `help` describes each name:

    laws        LuGre, BrownMcPhee, GMS, ... (ALL_LAWS by name, POPULATIONS of random contacts);
                Law, StaticLaw, State, Input, Switch, Facts (PHENOMENA), parametric, param, smooth
                to write laws, check_law (LawReport) to check them, Element, Slider, Level and
                Neuron to compose them; law_from_text and any_from_text (AnyLaw), law_name;
                steady_force, steady_inputs; PlanarSlip and SpatialSlip in a plane and in space
    machines    rabinowicz, drive; more in symfric.scenes (ALL_SCENES by name)
    equations   Model of Variable, Output, Event and Monitor; contact adds a law to it (Contact)
    mechanisms  Mechanism of bodies and joints with friction, read_urdf; more in symfric.multibody
    drives      Drive: motor, gear and encoder by their nameplate; driven(model, drive) adds them
    running     simulate, prepare for many calls, simulate_many, stepper, flow; inputs as numbers,
                functions of time or samples, Hold and Linear (rate_of: their rate); SolveError,
                Status of failed runs, OverloadWarning, EnergyWarning, LimitWarning of doubtful runs
    results     Trajectory (run["x"], run.at(times), run.at(run.step_times), run.extremes, plot,
                animate, save, to_csv, to_dataframe), load_run, Statistics, Plant, report; Ensemble
                (varied, extremes, plot, save, to_dataframe), load_ensemble; for_print
    choice      select ranks laws on a machine at equal error (Choice); work_precision measures time
                against error of the methods (WorkPrecision of WorkPoint)
    behaviour   figure and compare show laws (FigureData); recommended finds the smoothing for a
                required error (Recommendation)
    parameters  Parameter, parameters, with_values, symbolise

The package `ocp` solves optimal control problems, `identification` fits parameters to data,
`symfric.dynamics` finds equilibria, periodic orbits and their stability, `symfric.codegen` writes
C, and `symfric.fmu` writes FMI units. The command line is `symfric`.
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.choice import Choice as Choice
    from symfric.choice import WorkPoint as WorkPoint
    from symfric.choice import WorkPrecision as WorkPrecision
    from symfric.choice import select as select
    from symfric.choice import work_precision as work_precision
    from symfric.drives.drive import Drive as Drive
    from symfric.drives.driven import driven as driven
    from symfric.figures import FigureData as FigureData
    from symfric.figures import Recommendation as Recommendation
    from symfric.figures import compare as compare
    from symfric.figures import figure as figure
    from symfric.figures import recommended as recommended
    from symfric.foundation.panels import for_print as for_print
    from symfric.foundation.parameters import Parameter as Parameter
    from symfric.foundation.parameters import Variable as Variable
    from symfric.foundation.parameters import param as param
    from symfric.foundation.parameters import parameters as parameters
    from symfric.foundation.parameters import parametric as parametric
    from symfric.foundation.parameters import symbolise as symbolise
    from symfric.foundation.parameters import with_values as with_values
    from symfric.foundation.status import EnergyWarning as EnergyWarning
    from symfric.foundation.status import LimitWarning as LimitWarning
    from symfric.foundation.status import OverloadWarning as OverloadWarning
    from symfric.foundation.status import SolveError as SolveError
    from symfric.foundation.status import Status as Status
    from symfric.integrator import Ensemble as Ensemble
    from symfric.integrator import Hold as Hold
    from symfric.integrator import Linear as Linear
    from symfric.integrator import Plant as Plant
    from symfric.integrator import Statistics as Statistics
    from symfric.integrator import Trajectory as Trajectory
    from symfric.integrator import flow as flow
    from symfric.integrator import load_ensemble as load_ensemble
    from symfric.integrator import load_run as load_run
    from symfric.integrator import prepare as prepare
    from symfric.integrator import rate_of as rate_of
    from symfric.integrator import simulate as simulate
    from symfric.integrator import simulate_many as simulate_many
    from symfric.integrator import stepper as stepper
    from symfric.laws import *  # noqa: F403  (all of them)
    from symfric.model import Contact as Contact
    from symfric.model import Event as Event
    from symfric.model import Model as Model
    from symfric.model import Monitor as Monitor
    from symfric.model import Output as Output
    from symfric.multibody import Mechanism as Mechanism
    from symfric.multibody import read_urdf as read_urdf
    from symfric.results.report import report as report
    from symfric.scenes import contact as contact
    from symfric.scenes import drive as drive
    from symfric.scenes import rabinowicz as rabinowicz

load_lazily(__name__)

__version__ = "0.1.0"
