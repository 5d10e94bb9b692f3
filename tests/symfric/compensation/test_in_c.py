"""C of compensators and observers: the bits of CasADi, and nothing that is not finite."""

import numpy as np
import pytest
from one_program import OneProgram, has_bits, is_near, jobs_of

from symfric import GMS, BoucWen, LuGre, LuGrePassive, Stribeck
from symfric.codegen.guards import Status
from symfric.compensation import (
    Compensation,
    compensator,
    disturbance_observer,
    gms_observer,
    lugre_observer,
)

pytestmark = pytest.mark.heavy
FULL = Compensation(
    N="input", dead_zone=1e-3, inertia=1.0, delay=1e-3, error_gain=20.0, hold=(1e-5, 1e-3),
    stick=(1.0, 0.1, 1e-3), dither=(0.1, 100.0), limit=5.0, slew=100.0, offset=0.1,
)  # fmt: skip
TERMS = ["coulomb", "stribeck", "viscous", "bristle"]
TABLE = ((0, 0), (0.3, 0.6), (1, 1))
BLOCKS = [
    compensator(LuGre(), settings=FULL, scales=TERMS),
    compensator(GMS(form="event"), settings=FULL, scales=TERMS),
    compensator(Stribeck(v_eps=1e-3), settings=FULL, build_up=1e-4, build_up_table=TABLE),
    compensator(BoucWen(), N="input"),
    lugre_observer(LuGre(mu_s=6.0, mu_d=4.0, sigma_2=1.0), 20.0, limit=5.0),
    lugre_observer(LuGrePassive(), 20.0, h=1e-3),
    gms_observer(GMS(form="event", mu_s=6.0, mu_d=4.0), 20.0),
    disturbance_observer(1.0, 200.0, order=2),
]


@pytest.mark.parametrize("real", ["double", "float"])
def test_c_agrees_with_casadi_and_stays_finite(real, compiler, tmp_path):
    program = OneProgram(BLOCKS, tmp_path, compiler, real=real)
    if real == "double":
        has_bits(program)
    else:
        is_near(program, 1e-5)
    for rows in program.run([job for job in jobs_of(program) if np.isnan(job[1]).any()]):
        assert np.isfinite(rows).all()
        status = rows[:, -1].astype(int)
        assert status.any()
        assert not (status & Status.OUTPUT).any()
