"""Published results on the EMPS benchmark, to stand beside ours.

A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, Nonlinear System
Identification Benchmarks, 2019; estimation file DATA_EMPS, validation file DATA_EMPS_PULSES.
The position errors without feedback are our evaluation of the published parameters, starting at
the measured state like all of ours; with a start at rest they are 6.7 / 9.2 mm and 2.6 / 9.0 mm.
"""

from dataclasses import dataclass
from typing import final


@final
@dataclass(frozen=True)
class Published:
    """One published model: parameter -> (value, standard error), errors by quantity.

    Attributes:
        name: of the method.
        parameters: m [kg]; F_v [N s/m], F_c [N], also with _pos and _neg; offset [N].
        force_relative: inverse-model force error [%], estimation and validation.
        position_rms: simulated position error without feedback [m], estimation and validation.
        closed_loop: relative errors [%] of x, v, a, force, estimation and validation.
    """

    name: str
    parameters: dict[str, tuple[float, float]]
    force_relative: tuple[float, float]
    position_rms: tuple[float, float]
    closed_loop: tuple[tuple[float, ...], tuple[float, ...]] | None = None


EMPS = (
    Published(
        "least squares",
        {
            "m": (95.1089, 0.1085),
            "F_v": (203.5034, 1.1460),
            "F_c": (20.3935, 0.1012),
            "offset": (-3.1648, 0.0444),
        },
        (4.083, 5.98),
        (5.26e-3, 8.39e-3),
        ((0.013752, 0.229, 8.60, 5.85), (0.0080248, 0.479, 19.8, 8.94)),
    ),
    Published(
        "least squares, two directions",
        {
            "m": (95.154, 0.083),
            "F_v_pos": (166.71, 1.23),
            "F_c_pos": (20.144, 0.109),
            "F_v_neg": (240.42, 1.23),
            "F_c_neg": (20.628, 0.109),
        },
        (3.112, 5.3649),
        (3.29e-3, 12.7e-3),
    ),
)
"""The published models. Of the second, the standard errors but that of m and the validation error
are ours: the published procedure, repeated with scipy, gives all the other digits."""
