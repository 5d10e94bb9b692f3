"""Identify friction: of a drive from force and position, of any model from its motion."""

from identification.data import Dataset as Dataset
from identification.errors import ClosedLoopErrors as ClosedLoopErrors
from identification.errors import Errors as Errors
from identification.errors import evaluate as evaluate
from identification.filters import Filter as Filter
from identification.filters import central_difference as central_difference
from identification.filters import lowpass as lowpass
from identification.identify import identify as identify
from identification.loop import PositionLoop as PositionLoop
from identification.loop import closed_loop as closed_loop
from identification.motion import MotionFit as MotionFit
from identification.motion import identify_motion as identify_motion
from identification.read import read_data as read_data
from identification.regress import LinearFit as LinearFit
from identification.regress import linear_regression as linear_regression
from identification.result import Estimate as Estimate
from identification.result import Identification as Identification
from identification.signals import MotionSignals as MotionSignals
from identification.signals import differentiate as differentiate
from identification.stepper import Motion as Motion
from identification.stepper import open_loop as open_loop
from identification.synthetic import synthetic_drive_data as synthetic_drive_data
