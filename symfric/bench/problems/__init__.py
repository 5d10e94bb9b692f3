"""Initial-value problems of others with published solutions, one a file."""

from symfric.bench.problems import (
    akzo_nobel,
    andrews,
    car_axis,
    hires,
    oregonator,
    pleiades,
    ring_modulator,
    robertson,
    squeezer,
    transistor_amplifier,
    van_der_pol,
)
from symfric.bench.problems.problem import Problem

PROBLEMS: tuple[Problem, ...] = tuple(
    home.PROBLEM
    for home in (
        hires,
        robertson,
        van_der_pol,
        oregonator,
        akzo_nobel,
        transistor_amplifier,
        pleiades,
        ring_modulator,
        andrews,
        squeezer,
        car_axis,
    )
)
