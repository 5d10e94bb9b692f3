"""The slider-crank in Exudyn: friction in its crank by a user function that reads multipliers.

The engine has no friction that depends on reactions; a torque on the crank can ask the joint for
them. What helped it most is done here: the trapezoidal rule of index 2, the first of a number of
integrators in accuracy; modified Newton iterations; and a first tiny run that gives the multipliers
at the start, without which friction is missing there and the order falls to one.

`ForceLocal` of a generic joint is in the axes of its first body, and against the reaction;
`TorqueLocal` holds the multipliers of two scalar products, moments about y and -x of the second
body: found by comparison.
"""

import warnings
from collections.abc import Callable
from importlib import import_module
from math import cos, sin, sqrt, tanh
from typing import Any

import numpy as np

from symfric.bench.contenders import Array, Contender
from symfric.foundation.parameters import parameters
from symfric.laws import BrownMcPhee
from symfric.scenes import SliderCrank

TINY = 1e-9
"""Length of the first run [s]."""


def slider_crank(scene: SliderCrank, law: BrownMcPhee, times: Array, steps: int) -> Contender:
    """Exudyn with a number of equal steps; the position of the slider is watched.

    Raises:
        ModuleNotFoundError: it is not installed.
    """
    exu: Any = import_module("exudyn")
    exu.config.printToConsole = False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        system, _ = _system(exu, scene, law)
        system.SolveDynamic(_settings(exu, 1, TINY, TINY), solverType=_method(exu))
        multipliers = system.systemData.GetAECoordinates()

    def solve() -> tuple[Array, Callable[[], int]]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fresh, sensor = _system(exu, scene, law)
            fresh.systemData.SetAECoordinates(multipliers, exu.ConfigurationType.Initial)
            settings = _settings(exu, steps, float(times[-1]), float(times[1] - times[0]))
            fresh.SolveDynamic(settings, solverType=_method(exu))
            found = np.array(fresh.GetSensorStoredData(sensor))
        return np.interp(times, found[:, 0], found[:, 1])[None], lambda: steps

    return Contender(solve)


def _method(exu: Any) -> Any:
    return exu.DynamicSolverType.TrapezoidalIndex2


def _settings(exu: Any, steps: int, until: float, every: float) -> Any:
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = until
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = every
    return settings


def _system(exu: Any, scene: SliderCrank, law: BrownMcPhee) -> tuple[Any, Any]:
    """Bodies, joints, friction and a sensor on the slider."""
    of: Any = import_module("exudyn.utilities")
    s = {name: float(p.value) for name, p in parameters(scene).items()}
    reach = sqrt(s["l"] ** 2 - s["b"] ** 2 - (s["c"] + s["r"] - s["e"]) ** 2)
    axes = np.column_stack([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.CreateGround()

    def body(mass: float, moment: float, at: list[float], **velocity: list[float]) -> Any:
        inertia = of.RigidBodyInertia(mass=mass, inertiaTensor=moment * np.eye(3))
        return mbs.CreateRigidBody(
            inertia=inertia, referencePosition=at, gravity=[0.0, 0.0, -s["g"]], **velocity
        )

    at = [0.0, s["b"], s["c"]]
    crank = body(s["m_crank"], s["J"], at, initialAngularVelocity=[s["omega"], 0.0, 0.0])
    speed = s["b"] * s["r"] * s["omega"] / reach
    slider = body(s["m_slider"], 0.2, [reach, 0.0, 0.0], initialVelocity=[speed, 0.0, 0.0])

    def joint(child: Any, position: list[float], constrained: list[int]) -> Any:
        return mbs.CreateGenericJoint(
            itemNumbers=[ground, child], position=position, rotationMatrixAxes=axes,
            constrainedAxes=constrained, useGlobalFrame=True,
        )  # fmt: skip

    bearing = joint(crank, at, [1, 1, 1, 1, 1, 0])
    joint(slider, [reach, 0.0, 0.0], [1, 1, 0, 1, 1, 1])
    mbs.CreateDistanceConstraint(
        itemNumbers=[crank, slider], localPosition0=[0.0, 0.0, s["r"]],
        localPosition1=[0.0, 0.0, s["e"]], distance=s["l"],
    )  # fmt: skip
    marker = mbs.AddMarker(of.MarkerBodyRigid(bodyNumber=crank))
    mbs.AddLoad(
        of.LoadTorqueVector(
            markerNumber=marker, loadVector=[1.0, 0.0, 0.0],
            loadVectorUserFunction=_friction(exu, bearing, crank, s["R"], s["a"], law),
        )
    )  # fmt: skip
    sensor = mbs.AddSensor(
        of.SensorBody(
            bodyNumber=slider, outputVariableType=exu.OutputVariableType.Position,
            storeInternal=True, writeToFile=False,
        )
    )  # fmt: skip
    mbs.Assemble()
    return mbs, sensor


def _friction(
    exu: Any, bearing: Any, crank: Any, R: float, a: float, law: BrownMcPhee
) -> Callable[[Any, float, list[float]], list[float]]:
    """Torque of friction in a bearing of radius R with two stations a apart."""
    kind, eps = exu.OutputVariableType, 1e-4
    mu_s, mu_d, v_t = float(law.mu_s), float(law.mu_d), float(law.v_t)

    def size(*f: float) -> float:
        return sqrt(sum(x * x for x in f) + eps * eps) - eps

    def torque(mbs: Any, _: float, __: list[float]) -> list[float]:
        f = mbs.GetObjectOutput(bearing, kind.ForceLocal)
        moment = mbs.GetObjectOutput(bearing, kind.TorqueLocal)
        angle = mbs.GetObjectOutput(bearing, kind.Rotation)[2]
        c, s = cos(angle), sin(angle)
        fx, fy = -(c * f[0] + s * f[1]), s * f[0] - c * f[1]
        fx2, fy2 = -moment[0] / a, -moment[1] / a
        N = size(-fx - fx2, -fy - fy2) + size(fx2, fy2) + size(f[2])
        x = R * mbs.GetObjectOutputBody(crank, kind.AngularVelocity, [0, 0, 0])[0] / v_t
        mu = mu_d * tanh(4 * x) + (mu_s - mu_d) * x / (x * x / 4 + 0.75) ** 2
        return [-R * N * mu, 0.0, 0.0]

    return torque
