"""Parameter fields shared by many scenes: unit, role and bounds."""

from functools import partial

from symfric.foundation.parameters import param

MASS = partial(param, unit="kg", role="mass", lower=1e-12)
INERTIA = partial(param, unit="kg m^2", role="inertia", lower=1e-12)
SIZE = partial(param, unit="m", role="geometry", lower=1e-12)
PLACE = partial(param, unit="m", role="geometry")
STATIONS = partial(SIZE, doc="distance of the bearing stations")
SPRING = partial(param, unit="N/m", role="stiffness", lower=0.0)
SHAFT = partial(param, unit="N m/rad", role="stiffness", lower=0.0)
DAMPER = partial(param, unit="N s/m", role="damping", lower=0.0)
DRAG = partial(param, unit="N m s/rad", role="damping", lower=0.0)
LOAD = partial(param, unit="N", role="load", lower=0.0)
GRAVITY = partial(param, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)
START = partial(param, unit="m", role="motion")
ANGLE = partial(param, unit="rad", role="motion")
TURN = partial(param, unit="rad/s", role="motion")
VELOCITY = partial(param, unit="m/s", role="motion")
DURATION = partial(param, unit="s", role="motion", lower=1e-12)
