"""Identification of a robot from its URDF and logs of its joints: `identify_robot`."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.filters import Filter
from identification.data.record import Array
from identification.result.parts import Estimate
from identification.result.stored import plain
from identification.robot.base import Base, base_of, consistent
from identification.robot.dynamics import WHERE, RobotModel
from identification.robot.estimate import (
    METHODS,
    Estimated,
    Information,
    JointRows,
    estimate,
    information,
    seen_in,
)
from identification.robot.friction import USUAL, JointLaw, laws_of
from identification.robot.motion import RobotMotion, motions
from identification.robot.result import OFFSET, RobotFit, TorqueError, TorqueSeries
from identification.verdict.minimum import Sandwich
from symfric.foundation import checks
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Law, law_name

LawLike = Law | str | Mapping[str, Law | str]

HELD = 0.25
"""Last part of every record that is predicted from the first part."""
LARGE = 30.0
"""Error of a torque above which the model does not describe it [%]."""
SURE = 4.0
"""Standard errors by which the power of friction must be negative."""
WORK = 0.02
"""Power of friction, relative to that of the torque, below which its sign is not checked."""
POOR = 5.0
"""Error of a torque above which rotor inertias are tried [%]."""
WORSE = 1.2
"""Ratio of the errors with consistent inertias and without constraint that is reported."""
BETTER = 0.3
"""Decrease of the mean logarithm of the residuals for which a torque has the wrong sign."""


class _Prepared(NamedTuple):
    """Equations of a robot before the fit."""

    model: RobotModel
    base: Base
    motions: tuple[RobotMotion, ...]
    equations: JointRows
    laws: tuple[JointLaw, ...]
    rotors: bool
    information: Information

    def part(self, k: int) -> slice:
        """Return the coordinates of the law of joint k among all values."""
        sizes = [len(law.names) for law in self.laws]
        first = len(self.base.labels) + len(sizes) + sum(sizes[:k])
        return slice(first, first + sizes[k])


def identify_robot(
    urdf: str | Path,
    data: Dataset,
    law: LawLike = USUAL,
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
    `tau_shoulder` are also accepted. Torques are positive along the joint. Every joint must be in
    the log, except those that mimic another joint. The friction of the file is not used: the
    identified friction replaces it.

    Args:
        urdf: path of the file, or its content. It defines the kinematics; combinations of inertias
            that the data do not determine remain close to it.
        data: records of the joints, each with its own sample rate.
        law: friction law without states, of all joints or by joint.
        validation: records whose torques are predicted. None: the last quarter of every record is
            predicted from the rest; the values follow from all of it.
        method: "weighted": weights of each joint by its residuals (iteratively reweighted least
            squares); "robust": also less weight of outliers (Huber); "ordinary": equal weights.
        rotors: True to estimate the inertia of each rotor, reduced to its joint. It is separate
            from that of the links, because gears make rotors turn faster.
        filter: cut-off and decimation; None: chosen from the data.

    Raises:
        ValueError: mistakes of the file, missing columns, joints that all rest, a log that shows
            neither inertias nor friction, positions in other units, torques with the wrong sign.

    Limits: flexibility, backlash and friction that depends on load or position remain in the
    residuals. Intervals include the autocorrelation of the residuals, but not the errors of a wrong
    friction law or wrong kinematics.
    """
    checks.choice(f"{WHERE}: method", method, METHODS)
    made = _prepared(urdf, data, law, checks.flag(f"{WHERE}: rotors", rotors), filter)
    model, equations = made.model, made.equations
    if made.information.rank == 0 and equations.one_way(len(made.laws)).all():
        lengths = ", ".join(f"{record.time[-1] - record.time[0]:.3g} s" for record in data)
        raise ValueError(
            f"{WHERE}: expected a log that shows inertias or friction, got '{data.name}' of "
            f"{lengths}, in which no joint reverses; record for longer"
        )
    found = estimate(equations, made.laws, made.base, method)
    cover = found.covariance()
    _check_signs(made, found, cover, method)
    if validation is None:
        early = _early(equations)
        first = estimate(equations.at(early), made.laws, made.base, method)
        errors = _errors(made, first.x, equations.at(~early))
        held = f"last {HELD:.0%} of each record, predicted from the rest"
    else:
        others = motions(model, validation, filter or made.motions[0].filter)
        errors = _errors(made, found.x, JointRows.of(model, others, made.base, rotors))
        held = f"{validation.name}, which did not enter the fit"
    pi, spins, x = _consistent(made, found, cover)
    training, physical = (_errors(made, values, equations) for values in (found.x, x))
    is_text = isinstance(urdf, str) and urdf.lstrip().startswith("<")
    return RobotFit(
        name=model.urdf.name,
        urdf=str(urdf) if is_text else Path(urdf).read_text(encoding="utf-8-sig"),
        joints=model.names,
        laws={law.joint: law_name(law.law) for law in made.laws},
        **_estimates(made, found, cover),
        inertial=tuple(pi.tolist()),
        rotors=dict(zip(model.names, spins.tolist(), strict=True)) if rotors else {},
        **_for_consistent(made, x),
        information=made.information,
        validation=errors,
        training=training,
        consistent=physical,
        findings=(
            *_findings(made, training, physical),
            *_rotors_missing(made, found, training, method),
        ),
        series=_series(made, found),
        held=held,
    )


def robot_information(
    urdf: str | Path, data: Dataset, *, rotors: bool = False, filter: Filter | None = None
) -> Information:
    """Return which inertial parameters the data determine, and which joints to move, before a fit.

    The arguments are those of `identify_robot`.
    """
    return _prepared(urdf, data, USUAL, rotors, filter).information


def _prepared(
    urdf: str | Path, data: Dataset, law: LawLike, rotors: bool, filter: Filter | None
) -> _Prepared:
    model = RobotModel.read(urdf)
    moved = motions(model, data, filter)
    base = base_of(model, rotors)
    equations = JointRows.of(model, moved, base, rotors)
    speeds = np.sqrt(np.mean(np.vstack([one.v for one in moved]) ** 2, axis=0))
    usual, laws = laws_of(model, USUAL, speeds), laws_of(model, law, speeds)
    seen = seen_in(equations, base, usual)
    info = information(model, moved, base, equations, seen, rotors)
    equations = seen.without_faint(equations, base)
    if not all(one.linear for one in laws):
        laws = _started(model, equations, base, usual, laws)
    return _Prepared(model, base, moved, equations, laws, rotors, info)


def _started(
    model: RobotModel, equations: JointRows, base: Base, usual: Sequence[JointLaw],
    laws: Sequence[JointLaw],
) -> tuple[JointLaw, ...]:  # fmt: skip
    """Return nonlinear laws fitted to the friction that the usual law leaves at each joint."""
    found, b = estimate(equations, usual, base, "weighted"), len(base.labels)
    friction, started = equations.tau - equations.Z[:, :b] @ found.x[:b], list[JointLaw]()
    for k, law in enumerate(laws):
        on = equations.joint == k
        if not law.linear and on.any():
            law = law.fitted(equations.v[on], friction[on], model.units[k] == "rad")
        started.append(law)
    return tuple(started)


def _estimates(made: _Prepared, found: Estimated, cover: Sandwich) -> dict[str, Any]:
    """Return base parameters and friction with 95 % intervals.

    A level or offset is not determined if half of its interval exceeds the largest torque.
    """
    from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

    error = np.sqrt(np.diag(cover.coloured))
    size = np.maximum(np.abs(cover.null).max(axis=0, initial=0.0), 1e-300)
    error[(np.abs(cover.null) > 1e-4 * size).any(axis=1)] = np.nan
    half = stdtrit(cover.freedom, 0.975) * error

    def of(k: int, unit: str, most: float, logarithmic: bool = False) -> Estimate:
        x, reach = float(found.x[k]), float(half[k])
        if not 0 < reach < (most if unit in ("N", "N m") else np.inf):
            value = float(np.exp(x)) if logarithmic else x
            return Estimate(value, unit, note="not determined by the data")
        ends = np.array([x, x - reach, x + reach])
        value, low, high = (np.exp(np.clip(ends, -30, 30)) if logarithmic else ends).tolist()
        return Estimate(value, unit, float(error[k]) * (value if logarithmic else 1.0), low, high)

    b = len(made.base.labels)
    base = {label: of(k, made.base.units[k], np.inf) for k, label in enumerate(made.base.labels)}
    friction = dict[str, dict[str, Estimate]]()
    for k, law in enumerate(made.laws):
        if law.joint not in made.information.resting:
            first = made.part(k).start
            most = np.abs(made.equations.tau[made.equations.joint == k]).max()
            friction[law.joint] = {
                name: of(first + i, law.units[i], most, bool(law.logarithmic[i]))
                for i, name in enumerate(law.names)
            } | {OFFSET: of(b + k, made.model.forces[k], most)}
    return {"base": base, "friction": friction}


def _check_signs(made: _Prepared, found: Estimated, cover: Sandwich, method: str) -> None:
    """Check that friction dissipates energy, and that no torque fits better with the other sign.

    Raises:
        ValueError: friction accelerates a joint.
    """
    wrong, doubt, n = list[str](), False, len(made.laws)
    for k, law in enumerate(made.laws):
        on, part = made.equations.joint == k, made.part(k)
        v, tau = made.equations.v[on], made.equations.tau[on]
        if not v.size:
            continue
        force, slopes = law.at(v, found.x[part])
        power, slope = float(np.mean(v * force)), np.mean(v[:, None] * slopes, axis=0)
        error = float(np.sqrt(slope @ cover.coloured[part, part] @ slope))
        doubt |= power < 0
        if power + SURE * error < -WORK * float(np.std(tau) * np.std(v)):
            wrong.append(law.joint)
    found_at = list[float]()
    for k in range(n) if doubt else ():
        sign = np.where(made.equations.joint == k, -1.0, 1.0)
        turned = made.equations._replace(tau=sign * made.equations.tau)
        other = estimate(turned, made.laws, made.base, method)
        # all torques with the other sign fit equally well, but their friction adds energy
        found_at.append(other.unlikely if other.dissipation > 0 else np.inf)
    if doubt and found.unlikely - min(found_at) > BETTER * made.equations.tau.size / n:
        wrong = [made.model.names[int(np.argmin(found_at))]]
    if wrong:
        raise ValueError(
            f"{WHERE}: expected torques in the direction of the joints, got that of "
            f"{', '.join(wrong)} with the other sign, or exchanged columns; turn a sign by "
            f"data.scaled({{'{wrong[0]}_torque': -1}}) (--scale {wrong[0]}_torque=-1)"
        )


def _early(equations: JointRows) -> NDArray[np.bool_]:
    """Return a mask of the rows of the first part of every record."""
    early = np.zeros(equations.tau.size, dtype=np.bool_)
    for record in np.unique(equations.record):
        on = equations.record == record
        t = equations.t[on]
        early[on] = t <= t.max() - HELD * np.ptp(t)
    return early


def _errors(made: _Prepared, x: Array, equations: JointRows) -> dict[str, TorqueError]:
    """Return the errors of the torques predicted by the values x, by joint."""
    n = len(made.laws)
    left = equations.linearised(made.laws, x)[1] - equations.tau
    rms, size = equations.by_joint(left, n), equations.by_joint(equations.tau, n)
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
    base, size, x = made.base, made.model.pi.size, found.x.copy()
    b, spins = len(base.labels), 0.05 * base.rotors
    for k, column in enumerate(base.chosen):
        if column >= size:
            spins[column - size] = max(x[k], spins[column - size])
    pi, spins = consistent(x[:b], cover.coloured[:b, :b], base.K, made.model.pi, spins)
    x[:b] = base.K @ np.append(pi, spins)
    return pi, spins, found.refitted(x, b)


def _for_consistent(made: _Prepared, x: Array) -> dict[str, Any]:
    """Return offsets, laws, and f and d of f sign(v) + d v at the measured speeds, by joint."""
    b, equations = len(made.base.labels), made.equations
    offsets, laws, simple = dict[str, Any](), dict[str, Any](), dict[str, Any]()
    for k, law in enumerate(made.laws):
        v, own = equations.v[equations.joint == k], x[made.part(k)]
        if not v.size:
            continue
        known = parameters(law.law)
        values = zip(law.names, law.values(own).tolist(), strict=True)
        least = {name: max(value, float(known[name].lower)) for name, value in values}
        columns = np.column_stack([np.sign(v), v])
        f, d = np.linalg.lstsq(columns, law.at(v, own)[0], rcond=None)[0].tolist()
        offsets[law.joint] = float(x[b + k])
        laws[law.joint] = plain(with_values(law.law, least))
        simple[law.joint] = (max(f, 0.0), max(d, 0.0))
    return {"offsets": offsets, "law_data": laws, "urdf_friction": simple}


def _findings(
    made: _Prepared, training: Mapping[str, TorqueError], physical: Mapping[str, TorqueError]
) -> Iterator[str]:
    """Yield doubts about data and values."""
    given = [j.name for j in made.model.joints if j.friction or j.damping]
    if given:
        yield f"The friction of {', '.join(given)} in the URDF is replaced by the identified one."
    large = [joint for joint, error in training.items() if error.percent > LARGE]
    if large:
        yield (
            f"The model does not describe the torques of {', '.join(large)} (more than {LARGE:g} % "
            "remains): check columns, units and whether the log belongs to this robot."
        )
    worse = [joint for joint, error in physical.items() if error.rms > WORSE * training[joint].rms]
    if worse and not large:
        yield (
            f"No positive masses explain the torques of {', '.join(worse)} as well as the estimate:"
            " are the kinematics and the friction law right?"
        )


def _rotors_missing(
    made: _Prepared, found: Estimated, training: Mapping[str, TorqueError], method: str
) -> Iterator[str]:
    """Yield a message if rotor inertias reduce large errors."""
    if made.rotors or max(error.percent for error in training.values()) < POOR:
        return
    base = base_of(made.model, rotors=True)
    equations = JointRows.of(made.model, made.motions, base, rotors=True)
    after = estimate(equations, made.laws, base, method)
    if found.unlikely - after.unlikely > BETTER * equations.tau.size / len(made.laws):
        yield "Rotor inertias explain part of the errors: pass rotors=True (--rotors)."


def _series(made: _Prepared, found: Estimated) -> tuple[TorqueSeries, ...]:
    """Return the torques of all rows, also of those that did not enter the fit."""
    every = JointRows.of(made.model, made.motions, made.base, made.rotors, every=True)
    predicted, b = every.linearised(made.laws, found.x)[1], len(made.base.labels)
    rigid, series = every.Z[:, :b] @ found.x[:b], list[TorqueSeries]()
    for record, one in enumerate(made.motions):
        for k, joint in enumerate(made.model.names):
            on = (every.record == record) & (every.joint == k)
            t, v, tau = every.t[on], every.v[on], every.tau[on]
            used = one.kept[:, k].astype(float)
            made_of = joint, one.name, t, v, tau, predicted[on], rigid[on], used
            series.append(TorqueSeries(*made_of))
    return tuple(series)
