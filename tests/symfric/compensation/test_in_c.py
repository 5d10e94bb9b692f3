"""C of compensators and observers: the bits of CasADi, and nothing that is not finite."""

import numpy as np
import pytest
from one_program import Job, OneProgram, has_bits, jobs_of

from symfric import GMS, BoucWen, LuGre, LuGrePassive, Stribeck
from symfric.codegen.compared import Run
from symfric.codegen.guards import Status
from symfric.codegen.runner import run_vm
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
BAD = np.array([0.0, np.nan, np.inf, -np.inf, 5e-324, 1e-310, 1e300, -1e300, 1e30, 1e-30, -1e3])


def bad_jobs(program: OneProgram, steps: int = 1000) -> list[Job]:
    """A tenth of all inputs NaN, infinite, denormal, huge or zero; steps of 1 us to 1 s."""
    random, jobs = np.random.default_rng(0), list[Job]()
    for k, c in enumerate(program.several):
        shape = steps, len(c.block.inputs)
        usual = random.standard_normal(shape) * 10.0 ** random.integers(-9, 2, shape)
        inputs = np.where(random.random(shape) < 0.1, random.choice(BAD, shape), usual)
        p = np.tile([float(v.start) for v in c.block.parameters], (steps, 1))
        for i, v in enumerate(c.block.parameters):
            if v.name == "h":
                p[:, i] = 10.0 ** random.uniform(-6, 0, steps)
        jobs.append((k, inputs, p))
    return jobs


@pytest.mark.parametrize("real", ["double", "float"])
def test_c_is_that_of_casadi_and_bad_steps_leave_finite_numbers(real, compiler, tmp_path):
    program = OneProgram(BLOCKS, tmp_path, compiler, real=real)
    if real == "double":
        has_bits(program)
    else:
        jobs = [job for number, job in enumerate(jobs_of(program)) if number % 4 < 3]
        for (k, u, *p), rows in zip(jobs, program.run(jobs), strict=True):
            c, parameters = program.several[k], p[0] if p else None
            expected = run_vm(c, u, rows[:, : len(c.block.states)], parameters)
            run = Run(c, u, parameters, rows, expected)
            assert run.error <= 1e-5, (c.block.doc, run.worst)
    for rows in program.run(bad_jobs(program)):
        assert np.isfinite(rows).all()
        status = rows[:, -1].astype(int)
        assert status.any()
        assert not (status & Status.OUTPUT).any()
