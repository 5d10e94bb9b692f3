"""Coefficients of the methods, with order and source.

All of them have the dense output, 0 <= theta <= 1, with d_r = sum_j H_rj k_j:

    y(theta) = (1 - theta) y_0 + theta [y_1 + (1 - theta) (d_1 + theta (d_2 + theta d_3))]
"""

from dataclasses import replace

import numpy as np

from symfric.integrator.methods.explicit import Explicit, Exponential, shampine
from symfric.integrator.methods.implicit import BackwardEuler, Radau, Rosenbrock, through
from symfric.integrator.methods.method import Array, Method


def _lower(rows: list[list[float]]) -> Array:
    """Return a strictly lower triangular matrix from its rows."""
    matrix = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        matrix[i, : len(row)] = row
    return matrix


_RODAS5P_LAST = [
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
]

RODAS5P = Rosenbrock(
    name="Rodas5P",
    gamma=0.21193756319429014,
    A=_lower(
        [
            [],
            [3.0],
            [2.849394379747939, 0.45842242204463923],
            [-6.954028509809101, 2.489845061869568, -10.358996098473584],
            [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641],
            _RODAS5P_LAST,
            [*_RODAS5P_LAST, 1.0],
            [*_RODAS5P_LAST, 1.0, 1.0],
        ]
    ),
    C=_lower(
        [
            [],
            [-14.155112264123755],
            [-17.97296035885952, -2.859693295451294],
            [147.12150275711716, -1.41221402718213, 71.68940251302358],
            [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306],
            [
                24.854864614690072,
                -3.0009227002832186,
                47.4931110020768,
                5.5814197821558125,
                -0.6610691825249471,
            ],
            [
                30.91273214028599,
                -3.1208243349937974,
                77.79954646070892,
                34.28646028294783,
                -19.097331116725623,
                -28.087943162872662,
            ],
            [
                37.80277123390563,
                -3.2571969029072276,
                112.26918849496327,
                66.9347231244047,
                -40.06618937091002,
                -54.66780262877968,
                -9.48861652309627,
            ],
        ]
    ),
    H=np.array(
        [
            [
                25.948786856663858,
                -2.5579724845846235,
                10.433815404888879,
                -2.3679251022685204,
                0.524948541321073,
                1.1241088310450404,
                0.4272876194431874,
                -0.17202221070155493,
            ],
            [
                -9.91568850695171,
                -0.9689944594115154,
                3.0438037242978453,
                -24.495224566215796,
                20.176138334709044,
                15.98066361424651,
                -6.789040303419874,
                -6.710236069923372,
            ],
            [
                11.419903575922262,
                2.8879645146136994,
                72.92137995996029,
                80.12511834622643,
                -52.072871366152654,
                -59.78993625266729,
                -0.15582684282751913,
                4.883087185713722,
            ],
        ]
    ),
    order=5,
    embedded=4,
    dense=5,
    dense_dae=4,
    source="Steinebach, Construction of Rosenbrock-Wanner method Rodas5P, BIT 63:27, 2023",
)

_RODAS4P_LAST = [
    -7.170454962423024,
    -4.741636671481785,
    -16.31002631330971,
    -1.062004044111401,
]

RODAS4P = Rosenbrock(
    name="Rodas4P",
    gamma=0.25,
    A=_lower(
        [
            [],
            [3.0],
            [1.831036793486759, 0.4955183967433795],
            [2.304376582692669, -0.05249275245743001, -1.176798761832782],
            _RODAS4P_LAST,
            [*_RODAS4P_LAST, 1.0],
        ]
    ),
    C=_lower(
        [
            [],
            [-12.0],
            [-8.791795173947035, -2.207865586973518],
            [10.81793056857153, 6.780270611428266, 19.53485944642410],
            [34.19095006749676, 15.49671153725963, 54.74760875964130, 14.16005392148534],
            [
                34.62605830930532,
                15.30084976114473,
                56.99955578662667,
                18.40807009793095,
                -5.714285714285717,
            ],
        ]
    ),
    H=np.array(
        [
            [25.09876703708589, 11.62013104361867, 28.49148307714626, -5.664021568594133, 0.0, 0.0],
            [
                1.638054557396973,
                -0.7373619806678748,
                8.477918219238990,
                15.99253148779520,
                -1.882352941176471,
                0.0,
            ],
        ]
    ),
    order=4,
    embedded=3,
    dense=4,
    dense_dae=3,
    source="Steinebach, Order-reduction of ROW-methods for DAEs, TH Darmstadt preprint 1741, 1995",
)

RODAS3 = Rosenbrock(
    name="RODAS3",
    gamma=0.5,
    A=_lower([[], [0.0], [2.0, 0.0], [2.0, 0.0, 1.0]]),
    C=_lower([[], [4.0], [1.0, -1.0], [1.0, -1.0, -8.0 / 3.0]]),
    # derived here: the cubic in theta that meets the order conditions up to 2, that of f''(f, f),
    # and
    # that of order 2 of the algebraic variables
    H=np.array([[3.0, -1.0, -1.0, -1.0], [0.0, 0.0, 0.0, 2.0]]),
    order=3,
    embedded=2,
    dense=3,
    dense_dae=3,
    source="Sandu et al., Benchmarking stiff ODE solvers II, Atmos. Environ. 31, 1997",
)

_DOPRI5_LAST = [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]


DOPRI5 = Explicit(
    name="DOPRI5",
    A=_lower(
        [
            [],
            [1 / 5],
            [3 / 40, 9 / 40],
            [44 / 45, -56 / 15, 32 / 9],
            [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
            [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
            _DOPRI5_LAST,
        ]
    ),
    E=np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]),
    H=shampine(
        np.array([*_DOPRI5_LAST, 0.0]),
        np.array(
            [
                -12715105075 / 11282082432,
                0.0,
                87487479700 / 32700410799,
                -10690763975 / 1880347072,
                701980252875 / 199316789632,
                -1453857185 / 822651844,
                69997945 / 29380423,
            ]
        ),
    ),
    order=5,
    embedded=4,
    dense=5,
    source="Dormand and Prince, J. Comp. Appl. Math. 6, 1980; dense output by Shampine in Hairer, "
    "Norsett and Wanner II.6",
)


_ROOT = np.sqrt(6.0)
_RADAU_C = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])

RADAU5 = Radau(
    name="Radau5",
    c=_RADAU_C,
    E=np.array([-(13 + 7 * _ROOT) / 3, (-13 + 7 * _ROOT) / 3, -1 / 3]),
    H=through(_RADAU_C),
    iterations=3,
    order=5,
    embedded=3,
    dense=4,
    dense_dae=4,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8, 1996",
)

FOR_DERIVATIVES = replace(RADAU5, finer=8.0)
"""Method for derivatives of runs. A step that crosses the steep part of a law at once gives the
right motion, but a wrong derivative. With steps of half the width of that part, a quarter more of
them, derivatives of a pump err by 1.5e-4 instead of 6e-3 at rtol 1e-6. Derivatives of Rodas5P have
twenty times the error of Rodas5P itself.
"""

BACKWARD_EULER = BackwardEuler(
    name="backward Euler",
    iterations=4,
    order=1,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.3, 1996",
)

EXPONENTIAL = Exponential(
    name="exponential Euler",
    order=1,
    source="Hochbruck and Ostermann, Exponential integrators, Acta Numerica 19, 2010",
)

METHODS: dict[str, Method] = {
    "rodas5p": RODAS5P,
    "rodas4p": RODAS4P,
    "rodas3": RODAS3,
    "radau5": RADAU5,
    "dopri5": DOPRI5,
    "backward_euler": BACKWARD_EULER,
    "exponential": EXPONENTIAL,
}
"""All methods by their public names; the order test covers each of them."""

ADAPTIVE: dict[str, Method] = {name: m for name, m in METHODS.items() if m.adaptive}
"""Methods with step size control, for `simulate`."""


def key_of(method: Method) -> str:
    """Return the public name of `method`."""
    return next(key for key, known in METHODS.items() if known.name == method.name)
