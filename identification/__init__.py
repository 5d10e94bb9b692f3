"""Identify friction: of a drive from force and position, of any model from its motion."""

from identification.old.data import Dataset as Dataset
from identification.old.errors import ClosedLoopErrors as ClosedLoopErrors
from identification.old.errors import Errors as Errors
from identification.old.errors import evaluate as evaluate
from identification.old.filters import Filter as Filter
from identification.old.filters import central_difference as central_difference
from identification.old.filters import lowpass as lowpass
from identification.old.identify import identify as identify
from identification.old.loop import PositionLoop as PositionLoop
from identification.old.loop import closed_loop as closed_loop
from identification.old.motion import MotionFit as MotionFit
from identification.old.motion import identify_motion as identify_motion
from identification.old.read import read_data as read_data
from identification.old.regress import LinearFit as LinearFit
from identification.old.regress import linear_regression as linear_regression
from identification.old.result import Estimate as Estimate
from identification.old.result import Identification as Identification
from identification.old.signals import MotionSignals as MotionSignals
from identification.old.signals import differentiate as differentiate
from identification.old.stepper import Motion as Motion
from identification.old.stepper import open_loop as open_loop
from identification.old.synthetic import synthetic_drive_data as synthetic_drive_data
