"""Parameter fields shared by many laws: name, unit, role, bounds and meaning.

A law specifies the default, as in `mu_s: Scalar = MU_S(0.15)`, and may override properties, as in
`mu_d: Scalar = MU_D(0.1, lower=1e-12)` if it divides by the level.
"""

from functools import partial

from symfric.foundation.parameters import param

COEFFICIENT = partial(param, unit="1", role="level", lower=0.0)
MU_S = partial(COEFFICIENT, doc="static friction coefficient")
MU_D = partial(COEFFICIENT, doc="dynamic friction coefficient")
LEVEL = partial(param, unit="N", role="level", lower=0.0)
TORQUE = partial(param, unit="N m", role="level", lower=0.0)

SIGMA_2 = partial(param, unit="N s/m", role="viscous", doc="viscous coefficient", lower=0.0)
MU_V = partial(SIGMA_2, unit="s/m", doc="viscous coefficient, load-dependent")
DRAG = partial(SIGMA_2, unit="N m s/rad")

VELOCITY = partial(param, unit="m/s", role="velocity scale", lower=1e-12)
V_S = partial(VELOCITY, doc="Stribeck velocity")
V_T = partial(VELOCITY, width=1, doc="transition velocity")
STEEPNESS = partial(param, unit="s/m", role="velocity scale", lower=1e-12)

SHAPE = partial(param, unit="1", role="shape")
DELTA = partial(SHAPE, doc="Stribeck exponent", lower=0.1, upper=10.0)
SHARPNESS = partial(SHAPE, doc="sharpness of the yielding", lower=1.0, upper=1e3)
CURVATURE = partial(SHAPE, doc="curvature factor", upper=0.999)

STIFFNESS = partial(param, unit="N/m", role="stiffness", lower=1e-12)
SIGMA_0 = partial(STIFFNESS, doc="bristle stiffness")
SIGMA_1 = partial(param, unit="N s/m", role="damping", doc="bristle damping", lower=0.0)
LENGTH = partial(param, unit="m", role="length", lower=1e-15)
TIME = partial(param, unit="s", role="time", lower=1e-12)
LOAD = partial(param, unit="N", role="load", lower=0.0)
TEMPERATURE = partial(param, unit="K", role="temperature")
ANGLE = partial(param, unit="rad", role="geometry")

WIDTH = partial(param, unit="1", role="width", lower=1e-12)
V_EPS = partial(WIDTH, unit="m/s", width=1, doc="smoothing velocity", lower=0.0)
BAND = partial(WIDTH, unit="m/s", width=1)
F_EPS = partial(WIDTH, unit="N", doc="rounding of the break-away")
U_EPS = partial(WIDTH, doc="rounding of the peak", lower=0.0, upper=1.0)
REST_EPS = partial(WIDTH, unit="m/s", doc="smoothing velocity of |v|", lower=0.0)
"""Smoothing velocity of |v| in laws with states. It does not smooth the jump of the force at rest,
since the bristles do, so it is not marked as a `width`."""
R_EPS = partial(WIDTH, doc="smoothing of the load share")

SAMPLING = partial(param, unit="1", role="sampling")
