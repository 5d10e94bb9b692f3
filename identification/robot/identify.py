"""Identification of a robot from its URDF and logs of its joints: `identify_robot`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.filters import Filter
from identification.data.record import Array
from identification.result.series import Estimate
from identification.result.stored import plain
from identification.robot.base import Base, base_of, columns_of
from identification.robot.consistent import consistent
from identification.robot.dynamics import WHERE, RobotModel
from identification.robot.estimate import METHODS, Equations, Estimated, estimate
from identification.robot.friction import USUAL, JointLaw, laws_of
from identification.robot.information import Information, information
from identification.robot.motion import RobotMotion, motions
from identification.robot.result import OFFSET, RobotFit, TorqueError, TorqueSeries
from identification.verdict.minimum import Sandwich
from symfric.foundation import checks
from symfric.foundation.parameters import with_values
from symfric.laws import Law, law_name

HELD = 0.25
"""Last part of every record that is predicted from the first part."""
LARGE = 30.0
"""Error of a torque above which the model does not describe it [%]."""
WORK = 0.02
"""Least power of friction, relative to that of the torque, for which its sign is checked."""


@final
@dataclass(frozen=True, eq=False)
class _Prepared:
    """Equations of a robot before the fit."""

    model: RobotModel
    base: Base
    motions: tuple[RobotMotion, ...]
    equations: Equations
    laws: tuple[JointLaw, ...]
    rotors: bool
    information: Information


def identify_robot(
    urdf: str | Path,
    data: Dataset,
    law: Law | str | Mapping[str, Law | str] = USUAL,
    *,
    validation: Dataset | None = None,
    method: str = "weighted",
    rotors: bool = False,
    filter: Filter | None = None,
) -> RobotFit:
    """Identify inertias and friction of a robot from its URDF and logs of its joints.

        tau = Y(q, q', q'') pi + rotor inertia q'' + F(q') + offset

    The columns of the data have the names of the joints: position `shoulder [rad]`, torque
    `shoulder_torque [N m]`, and optionally `shoulder_velocity [rad/s]`; `q_shoulder` and
    `tau_shoulder` are accepted, too. Torques are positive along the joint. Every joint must be in
    the log, except those that mimic another joint. The friction of the file is not used: the
    identified friction replaces it.

    Args:
        urdf: path of the file, or its content. It defines the kinematics; its inertias are the
            prior values of combinations that the data do not determine.
        data: records of the joints, with any number of samples and sample rates.
        law: friction law without states, of all joints or by joint.
        validation: records whose torques are predicted. None: the last quarter of every record is
            predicted from the rest; the values follow from all of it.
        method: "weighted": weights of each joint by its residuals (iteratively reweighted least
            squares); "robust": also less weight of outliers (Huber); "ordinary": equal weights.
        rotors: True to estimate the inertia of each rotor, reduced to its joint. It is separate
            from the links because gears make rotors turn faster.
        filter: cut-off and decimation; None: chosen from the data.

    Raises:
        ValueError: mistakes of the file, missing columns, joints that all rest, positions in other
            units, torques with the wrong sign.

    Limits: torques are those of the joints; flexibility, backlash and friction that depends on load
    or position remain in the residuals. Intervals include the autocorrelation of the residuals, but
    not the errors of a wrong friction law or of wrong kinematics.
    """
    checks.choice(f"{WHERE}: method", method, METHODS)
    checks.flag(f"{WHERE}: rotors", rotors)
    made = _prepared(urdf, data, law, rotors, filter)
    model, base, equations = made.model, made.base, made.equations
    found = estimate(equations, made.laws, base, method)
    names = _names(made)
    cover = found.minimum(names).sandwich
    _check_signs(made, found, cover)
    if validation is None:
        early, late = _split(equations)
        errors = _errors(
            made, estimate(equations.at(early), made.laws, base, method), equations.at(late)
        )
        held = f"last {HELD:.0%} of each record, predicted from the rest"
    else:
        others = motions(model, validation, made.motions[0].filter if filter is None else filter)
        errors = _errors(made, found, Equations.of(model, others, base, rotors))
        held = f"on {validation.name}"
    pi, spins, x = _consistent(made, found, cover)
    training = _errors(made, found, equations)
    return RobotFit(
        name=model.urdf.name,
        urdf=_text(urdf),
        joints=model.names,
        laws={law.joint: law_name(law.law) for law in made.laws},
        friction=_friction(made, found, cover),
        base=_base(made, found, cover),
        inertial=tuple(pi.tolist()),
        rotors=dict(zip(model.names, spins.tolist(), strict=True)) if rotors else {},
        offsets=dict(zip(model.names, x[len(base.labels) :].tolist(), strict=False)),
        law_data={law.joint: plain(with_values(law.law, _values(made, x, k))) for k, law in enumerate(made.laws)},
        urdf_friction=_urdf_friction(made, x),
        information=made.information,
        validation=errors,
        training=training,
        consistent=_errors(made, found, equations, x),
        findings=tuple(_findings(made, training, errors)),
        series=_series(made, found),
        held=held,
    )  # fmt: skip


def robot_information(
    urdf: str | Path, data: Dataset, *, rotors: bool = False, filter: Filter | None = None
) -> Information:
    """Return which inertial parameters the data determine, and which joints to move, before a fit.

    The arguments are those of `identify_robot`.
    """
    return _prepared(urdf, data, USUAL, rotors, filter).information


def _prepared(
    urdf: str | Path, data: Dataset, law: Law | str | Mapping[str, Law | str], rotors: bool,
    filter: Filter | None,
) -> _Prepared:  # fmt: skip
    checks.kind(f"{WHERE}: data", data, Dataset, "a Dataset")
    model = RobotModel.read(urdf)
    moved = motions(model, data, filter)
    base = base_of(model, columns_of(model, rotors), rotors)
    equations = Equations.of(model, moved, base, rotors)
    speeds = np.sqrt(np.mean(np.vstack([one.v for one in moved]) ** 2, axis=0))
    usual, laws = laws_of(model, USUAL, speeds), laws_of(model, law, speeds)
    seen = information(model, moved, base, equations, usual, rotors)
    if not all(one.linear for one in laws):
        laws = _started(model, equations, base, usual, laws)
    return _Prepared(model, base, moved, equations, laws, rotors, seen)


def _started(
    model: RobotModel, equations: Equations, base: Base, usual: Sequence[JointLaw],
    laws: Sequence[JointLaw],
) -> tuple[JointLaw, ...]:  # fmt: skip
    """Return nonlinear laws fitted to the friction that the usual law leaves at each joint."""
    found, started = estimate(equations, usual, base, "weighted"), list[JointLaw]()
    rigid = equations.Z[:, : len(base.labels)] @ found.x[: len(base.labels)]
    for k, law in enumerate(laws):
        on = equations.joint == k
        if not law.linear and on.any():
            turning = model.units[k] == "rad"
            law = law.fitted(equations.v[on], (equations.tau - rigid)[on], turning)
        started.append(law)
    return tuple(started)


def _names(made: _Prepared) -> list[str]:
    offsets = [f"{OFFSET} {joint}" for joint in made.model.names]
    return [
        *made.base.labels,
        *offsets,
        *(f"{n} {law.joint}" for law in made.laws for n in law.names),
    ]


def _part(made: _Prepared, k: int) -> slice:
    """Return the coordinates of the law of joint k among all values."""
    sizes = [len(law.names) for law in made.laws]
    first = len(made.base.labels) + len(sizes) + sum(sizes[:k])
    return slice(first, first + sizes[k])


def _values(made: _Prepared, x: Array, k: int) -> dict[str, float]:
    """Return the parameters of the law of joint k."""
    law = made.laws[k]
    return dict(zip(law.names, law.values(x[_part(made, k)]).tolist(), strict=True))


def _intervals(cover: Sandwich, x: Array) -> tuple[Array, Array]:
    """Return standard errors and half widths of 95 % intervals; NaN without one, shape (p,)."""
    from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

    error = np.sqrt(np.diag(cover.coloured))
    size = np.maximum(np.abs(cover.null).max(axis=0, initial=0.0), 1e-300)
    lost = (np.abs(cover.null) / size > 1e-4).any(axis=1) | ~(error > 0)
    error = np.where(lost, np.nan, error)
    return error, stdtrit(cover.freedom, 0.975) * error


def _estimate(value: float, unit: str, error: float, half: float, log: bool = False) -> Estimate:
    if not np.isfinite(error):
        return Estimate(value, unit, note="not determined by the data")
    low, high = (
        (value * np.exp(-half), value * np.exp(half)) if log else (value - half, value + half)
    )
    return Estimate(value, unit, value * error if log else error, float(low), float(high))


def _base(made: _Prepared, found: Estimated, cover: Sandwich) -> dict[str, Estimate]:
    error, half = _intervals(cover, found.x)
    rows = zip(
        made.base.labels,
        made.base.units,
        found.x.tolist(),
        error.tolist(),
        half.tolist(),
        strict=False,
    )
    return {label: _estimate(x, unit, e, h) for label, unit, x, e, h in rows}


def _friction(made: _Prepared, found: Estimated, cover: Sandwich) -> dict[str, dict[str, Estimate]]:
    error, half = _intervals(cover, found.x)
    result, b = dict[str, dict[str, Estimate]](), len(made.base.labels)
    for k, law in enumerate(made.laws):
        if law.joint in made.information.resting:
            continue
        part, own = _part(made, k), dict[str, Estimate]()
        rows = zip(law.names, law.units, law.values(found.x[part]), error[part], half[part],
                   law.logarithmic, strict=True)  # fmt: skip
        for name, unit, value, e, h, log in rows:
            own[name] = _estimate(float(value), unit, float(e), float(h), bool(log))
        own[OFFSET] = _estimate(found.x[b + k], made.model.forces[k], error[b + k], half[b + k])
        result[law.joint] = own
    return result


def _check_signs(made: _Prepared, found: Estimated, cover: Sandwich) -> None:
    """Check that friction dissipates energy.

    Raises:
        ValueError: friction significantly accelerates a joint.
    """
    wrong = list[str]()
    for k, law in enumerate(made.laws):
        on, part = made.equations.joint == k, _part(made, k)
        if not on.any():
            continue
        v, tau = made.equations.v[on], made.equations.tau[on]
        F, J = law.at(v, found.x[part])
        power, slope = float(np.mean(v * F)), np.mean(v[:, None] * J, axis=0)
        error = float(np.sqrt(slope @ cover.coloured[part, part] @ slope))
        if power + 4 * error < -WORK * float(np.std(tau) * np.std(v)):
            wrong.append(law.joint)
    if wrong:
        first = wrong[0]
        raise ValueError(
            f"{WHERE}: expected friction that opposes the motion, got friction that accelerates "
            f"{', '.join(wrong)}; if the torque has the wrong sign, pass "
            f"data.scaled({{'{first}_torque': -1}}) (--scale {first}_torque=-1)"
        )


def _split(equations: Equations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks of the rows of the first and the last part of every record."""
    late = np.zeros(equations.tau.size, dtype=bool)
    ends = dict[int, list[float]]()
    for c in equations.channels:
        ends.setdefault(c.record, []).extend((float(c.t[0]), float(c.t[-1])))
    for c in equations.channels:
        low, high = min(ends[c.record]), max(ends[c.record])
        late[c.rows] = c.t > high - HELD * (high - low)
    return ~late, late


def _errors(
    made: _Prepared, found: Estimated, equations: Equations, x: Array | None = None
) -> dict[str, TorqueError]:
    """Return the errors of the predicted torques by joint, of other values if given."""
    n = len(made.laws)
    predicted = equations.linearised(made.laws, found.x if x is None else x)[1]
    rms = equations.by_joint(predicted - equations.tau, n)
    size = equations.by_joint(equations.tau, n)
    counts = np.bincount(equations.joint, minlength=n)
    return {
        joint: TorqueError(
            float(rms[k]), float(100 * rms[k] / max(size[k], 1e-300)), int(counts[k])
        )
        for k, joint in enumerate(made.model.names)
        if counts[k]
    }


def _consistent(made: _Prepared, found: Estimated, cover: Sandwich) -> tuple[Array, Array, Array]:
    """Return consistent inertial parameters and rotor inertias, and all values that fit to them."""
    base, model = made.base, made.model
    b, n = len(base.labels), len(model.joints) if made.rotors else 0
    sizes = np.array([
        max(found.x[base.chosen.index(k)] if k in base.chosen else 0.0, 0.05 * scale)
        for k, scale in enumerate(columns_of(model, made.rotors).scales)
    ])[model.pi.size :]  # fmt: skip
    C = cover.coloured[:b, :b]
    pi, spins = consistent(found.x[:b], C, base.K, model.pi, sizes[:n])
    x = found.x.copy()
    x[:b] = base.K @ np.append(pi, spins)
    weight = np.sqrt(found.weights) / found.sigma[made.equations.joint]
    change = (found.A[:, :b] @ (x[:b] - found.x[:b])) * weight
    rest = found.A[:, b:] * weight[:, None]
    size = np.linalg.norm(rest, axis=0)
    size = np.where(size > 0, size, 1.0)
    x[b:] -= np.linalg.lstsq(rest / size, change, rcond=1e-10)[0] / size
    return pi, spins, x


def _urdf_friction(made: _Prepared, x: Array) -> dict[str, tuple[float, float]]:
    """Return f and d of f sign(v) + d v, fitted to the law at the measured speeds, by joint."""
    found = dict[str, tuple[float, float]]()
    for k, law in enumerate(made.laws):
        on = made.equations.joint == k
        if on.any():
            v = made.equations.v[on]
            F = law.at(v, x[_part(made, k)])[0]
            f, d = np.linalg.lstsq(np.column_stack([np.sign(v), v]), F, rcond=None)[0].tolist()
            found[law.joint] = (max(f, 0.0), max(d, 0.0))
    return found


def _findings(
    made: _Prepared, training: Mapping[str, TorqueError], errors: Mapping[str, TorqueError]
) -> Iterator[str]:
    """Yield doubts about data and values."""
    given = [j.name for j in made.model.joints if j.friction or j.damping]
    if given:
        yield f"The friction of {', '.join(given)} in the URDF is replaced by the identified one."
    large = [joint for joint, error in training.items() if error.percent > LARGE]
    if large:
        yield (
            f"The model does not describe the torques of {', '.join(large)} (more than {LARGE:g} % "
            "remains): check the columns, the units and whether the log belongs to this robot."
        )
    worse = [j for j, e in errors.items() if e.rms > 2 * training[j].rms] if errors else []
    if worse and not large:
        yield f"The torques of {', '.join(worse)} are predicted worse than they are fitted."


def _series(made: _Prepared, found: Estimated) -> tuple[TorqueSeries, ...]:
    """Return the torques of all rows, also of those that did not enter the fit."""
    whole = [replace(one, kept=np.ones_like(one.kept)) for one in made.motions]
    equations = Equations.of(made.model, whole, made.base, made.rotors)
    predicted = equations.linearised(made.laws, found.x)[1]
    b, series = len(made.base.labels), list[TorqueSeries]()
    for c in equations.channels:
        one, k = made.motions[c.record], made.model.names.index(c.signal)
        rigid = equations.Z[c.rows, :b] @ found.x[:b]
        used = one.kept[:, k].astype(float)
        series.append(
            TorqueSeries(
                c.signal, one.name, c.t, one.v[:, k], c.measured, predicted[c.rows], rigid, used
            )
        )
    return tuple(series)


def _text(urdf: str | Path) -> str:
    is_text = isinstance(urdf, str) and urdf.lstrip().startswith("<")
    return str(urdf) if is_text else Path(urdf).read_text(encoding="utf-8")
