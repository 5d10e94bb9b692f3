"""A fit of a static law to force under measured velocity, made without the kinds of residuals."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.residuals.evaluation import Channel, Evaluation
from identification.unknowns.subject import Subject
from identification.unknowns.unknown import Unknown

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """r = F(v; p) + b - force of all records, with a bias b of each record of its own."""

    names: tuple[str, ...]
    own: tuple[Unknown, ...]
    channels: tuple[Channel, ...]
    force: ca.Function

    def at(self, values: Array) -> Evaluation | str:
        p, b = values[: len(values) - len(self.own)], values[len(values) - len(self.own) :]
        r, J = [], []
        for channel in self.channels:
            v = channel.regressors["v"]
            F, slope = self.force.map(v.size)(v[None, :], np.tile(p[:, None], v.size))
            r.append(np.asarray(F).ravel() + b[channel.record] - channel.measured)
            mine = np.zeros((v.size, len(self.own)))
            mine[:, channel.record] = 1.0
            J.append(np.hstack([np.asarray(slope).T, mine]))
        return Evaluation(np.concatenate(r), np.vstack(J))


@final
@dataclass(frozen=True)
class ForceUnderVelocity:
    """Static friction of a record with v and force."""

    note: str = ""

    def prepare(
        self, subject: Subject, data: Dataset, start: Mapping[str, float] | None = None
    ) -> Rows:
        model = subject.model
        v, N = model.u[0].symbol, model.u[1]
        F = ca.substitute(model.outputs["F"].expression, N.symbol, N.start)
        p = model.vector("p")
        force = ca.Function("force", [v, p], [F, ca.densify(ca.gradient(F, p))])
        channels: list[Channel] = []
        begin = 0
        for k, record in enumerate(data):
            t = record.time
            rows = slice(begin, begin + t.size)
            begin += t.size
            signals = {"v": record["v"]}
            channels.append(Channel(k, "force", "N", rows, t, record["force"], signals))
        own = tuple(
            Unknown(f"bias[{k}]", "N", 0.0, nuisance=True) for k in range(len(data.records))
        )
        return Rows((*subject.names, *(u.name for u in own)), own, tuple(channels), force)
