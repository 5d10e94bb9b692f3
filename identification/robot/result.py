"""Result of the identification of a robot: table, torques, figure, files."""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np

from identification.data.dataset import Dataset
from identification.data.record import Array
from identification.result.parts import Estimate
from identification.result.stored import from_data, plain, revived
from identification.robot.dynamics import RobotModel, inertial_of, updated_urdf
from identification.robot.estimate import Information
from symfric.foundation import checks
from symfric.foundation.files import read_json, write_text
from symfric.foundation.shown import Showing, Shown, TextTable, columns, counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMAT = 1
OFFSET = "offset"
"""Name of the constant torque of a joint among its friction parameters."""


@final
@dataclass(frozen=True)
class TorqueError:
    """Error of the predicted torque of a joint.

    Attributes:
        rms: root mean square error [N m, N].
        percent: `rms` relative to the root mean square of the measured torque [%].
        rows: number of compared torques, after filter and decimation.
    """

    rms: float
    percent: float
    rows: int


@final
@dataclass(frozen=True, eq=False)
class TorqueSeries:
    """Torques of one joint and record after the filter, shape (R,) each.

    Attributes:
        joint, record: name of the joint, name of the record.
        t, v: times [s] and velocities.
        measured, predicted: torques with friction and offset.
        rigid: part of `predicted` without friction and offset.
        used: 1 for rows that entered the fit, 0 near reversals.
    """

    joint: str
    record: str
    t: Array
    v: Array
    measured: Array
    predicted: Array
    rigid: Array
    used: Array


@final
@dataclass(frozen=True, eq=False, repr=False)
class RobotFit(Showing):
    """Identified robot.

    Attributes:
        name: name of the robot.
        urdf: content of its file, before the identification.
        joints: names of the joints.
        laws: joint -> text of its friction law.
        friction: joint -> parameter of its law, or "offset" -> estimate; joints that rest are
            missing.
        base: base parameter -> estimate by least squares.
        inertial: physically consistent inertial parameters, ten for each body.
        rotors: joint -> inertia of its rotor, reduced to the joint; empty if not estimated.
        offsets: joint -> constant torque for `inertial`.
        law_data: joint -> law with its values for `inertial`, as data.
        urdf_friction: joint -> Coulomb friction and damping for `inertial`.
        information: what the data show.
        validation: joint -> error on data that did not enter the fit.
        training: joint -> error on the fitted data.
        consistent: joint -> error of `inertial` on the fitted data.
        findings: doubts about the data or the values, in words.
        series: measured and predicted torques of the fitted data.
        held: text that describes the validation data.
    """

    name: str
    urdf: str
    joints: tuple[str, ...]
    laws: dict[str, str]
    friction: dict[str, dict[str, Estimate]]
    base: dict[str, Estimate]
    inertial: tuple[float, ...]
    rotors: dict[str, float]
    offsets: dict[str, float]
    law_data: dict[str, Any]
    urdf_friction: dict[str, tuple[float, float]]
    information: Information
    validation: dict[str, TorqueError]
    training: dict[str, TorqueError]
    consistent: dict[str, TorqueError]
    findings: tuple[str, ...]
    series: tuple[TorqueSeries, ...]
    held: str = ""

    def shown(self) -> Shown:
        """Return friction with half the width of 95 % intervals, and errors, of each joint."""
        every = dict.fromkeys(n for own in self.friction.values() for n in own)
        names = sorted(every, key=lambda name: name == OFFSET)
        each = [{own[n].unit for own in self.friction.values() if n in own} for n in names]
        units = [f" [{', '.join(sorted(unit))}]" for unit in each]
        error = f"error{units[-1] if units else ''}"
        header = ("joint", *map("".join, zip(names, units, strict=True)), error, "of the torque")
        rows = list[tuple[str, ...]]()
        for joint in self.joints:
            own, off = self.friction.get(joint, {}), self.validation.get(joint)
            cells = [_cell(own[n]) if n in own else "-" for n in names]
            last = ("-", "-") if off is None else (f"{off.rms:.3g}", f"{off.percent:.2g} %")
            rows.append((joint, *cells, *last))
        laws = " and ".join(dict.fromkeys(self.laws.values()))
        lines = (*self.information.sentences, f"Error of the torques: {self.held}.")
        return Shown(
            f"robot '{self.name}': {counted(len(self.joints), 'joint')}, law {laws}",
            lines, TextTable(header, tuple(rows)), self.findings,
        )  # fmt: skip

    def __str__(self) -> str:
        shown = self.shown()
        table = columns((shown.table.header, *shown.table.rows))
        after = ["", *shown.after] if shown.after else []
        return "\n".join([shown.title, *shown.lines, "", *table, *after])

    @cached_property
    def model(self) -> RobotModel:
        """Robot of the original file."""
        return RobotModel.read(self.urdf)

    @property
    def bodies(self) -> dict[str, dict[str, Any]]:
        """Link -> consistent mass [kg], centre of mass [m] and inertia about it [kg m^2]."""
        rows = zip(self.model.bodies, np.reshape(self.inertial, (-1, 10)), strict=True)
        return {name: inertial_of(row)._asdict() for name, row in rows}

    def torques(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return predicted torques, with friction and offsets, for N samples, shape (N, n).

        The inertias are the physically consistent ones.

        Args:
            q, qd, qdd: motion in the order of `joints`, shape (N, n) each.
        """
        q, qd, qdd = (np.asarray(y, dtype=float) for y in (q, qd, qdd))
        if not q.shape == qd.shape == qdd.shape == (q.size // len(self.joints), len(self.joints)):
            such = f"q, qd and qdd of shape (N, {len(self.joints)})"
            got = f"{q.shape}, {qd.shape} and {qdd.shape}"
            raise ValueError(f"torques: expected {such}, got {got}")
        tau = self.model.torques(q, qd, qdd, np.array(self.inertial))
        for k, joint in enumerate(self.joints):
            tau[:, k] += self.rotors.get(joint, 0.0) * qdd[:, k] + self.offsets.get(joint, 0.0)
            if joint in self.law_data:
                tau[:, k] += np.asarray(from_data(self.law_data[joint]).force(qd[:, k], 1.0))
        return tau

    def friction_data(self, joint: str) -> Dataset:
        """Return velocity v and friction torque F of a joint, with its offset, for other laws.

        F is the measured torque minus that of the inertias; rows near reversals are included. Laws
        with states are fitted by `Fit(Points(offset=True), law, fit.friction_data("joint"))`.
        """
        checks.choice("friction_data: joint", joint, self.joints)
        turning = self.model.units[self.joints.index(joint)] == "rad"
        units = {"v": "rad/s", "F": "N m"} if turning else {"v": "m/s", "F": "N"}
        own = [one for one in self.series if one.joint == joint]
        friction = [(one.t, one.v, one.measured - one.rigid, one.record) for one in own]
        each = [Dataset.of(t=t, v=v, F=F, units=units, name=name)[0] for t, v, F, name in friction]
        return Dataset(tuple(each))

    def to_urdf(self, path: str | Path) -> Path:
        """Write the URDF with consistent inertias, Coulomb friction and damping.

        Limits: the format has neither offsets nor rotor inertias, and of friction only
        f sign(w) + d w, to which other laws are approximated at the recorded speeds.
        """
        text = updated_urdf(self.urdf, self.model, np.array(self.inertial), self.urdf_friction)
        write_text(path, f'<?xml version="1.0"?>\n{text}\n')
        return Path(path)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON-compatible data, without the torques over time."""
        return {key: value for key, value in plain(self).items() if key not in ("series", "urdf")}

    def save(self, path: str | Path) -> Path:
        """Write the result as JSON, which `load_robot` reads."""
        write_text(path, json.dumps({"robot_format": FORMAT, **plain(self)}) + "\n")
        return Path(path)

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot measured and predicted torques over time with the residuals, by joint.

        Args:
            path: image file to write.
        """
        from symfric.foundation.panels import grid, save  # noqa: PLC0415 (slow to import)
        from symfric.foundation.style import colour  # noqa: PLC0415 (slow to import)

        n = len(self.joints)
        figure, rows = grid(n, 2, width=9.0, height=0.7 + 1.5 * n, sharex=True)
        for k, (joint, (left, right)) in enumerate(zip(self.joints, rows, strict=True)):
            unit = self.model.forces[k]
            start = 0.0
            for one in self.series:
                if one.joint != joint:
                    continue
                t = one.t - one.t[0] + start
                start = float(t[-1])
                used, error = one.used > 0, one.measured - one.predicted
                left.plot(t, one.measured, color="0.6", lw=2.0, label="measured")
                left.plot(t, one.predicted, color=colour(1), lw=0.8, label="predicted")
                right.plot(t[~used], error[~used], ".", color="0.7", ms=2.0, mew=0)
                right.plot(t[used], error[used], ".", color=colour(0), ms=2.0, mew=0)
            left.set_ylabel(f"{joint} [{unit}]")
            if k == 0:
                left.set_title("torque", fontsize="medium", loc="left")
                right.set_title(
                    "measured - predicted (grey: reversals, not fitted)", fontsize="medium"
                )
                handles, labels = left.get_legend_handles_labels()
                left.legend(
                    handles[:2], labels[:2], loc="lower right", bbox_to_anchor=(1.0, 1.0),
                    frameon=False, fontsize="small", ncols=2,
                )  # fmt: skip
        for axis in rows[-1]:
            axis.set_xlabel("t [s]")
        return save(figure, path)


def _cell(one: Estimate) -> str:
    """Return a value with half the width of its interval."""
    if one.low is None or one.high is None:
        return "not determined"
    half = (one.high - one.low) / 2
    return f"{one.value:.4g} ± {half:.2g}"


def load_robot(path: str | Path) -> RobotFit:
    """Read a result that `RobotFit.save` wrote.

    Raises:
        ValueError: not such a file, or a format of a later version.
    """
    content = read_json("load_robot", path, "the result of identify_robot")
    if content.pop("robot_format", None) != FORMAT:
        such = f"the result of identify_robot in format {FORMAT}"
        raise ValueError(f"load_robot '{path}': expected {such}, got another file")
    try:
        return revived(RobotFit, content)
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise ValueError(f"load_robot '{path}': expected a complete file, got {error!r}") from None
