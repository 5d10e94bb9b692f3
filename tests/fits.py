"""Fits to look at, right and wrong: a static law, force under measured velocity, closed forms."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.findings import Finding
from identification.residuals.evaluation import Channel, Evaluation, Residuals
from identification.result.build import fitted, tried
from identification.result.fitted import Fitted
from identification.result.parts import Live
from identification.solving.descent import best_of, many_starts
from identification.solving.task import task
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject, subject
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.judge import judge
from symfric.foundation.numeric import Array
from symfric.laws import Law, Stribeck

TRUTH = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, delta=2.0, sigma_2=200.0, v_eps=1e-4)


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


def record(seed: int, n: int = 1500, noise: float = 0.5, name: str = "run") -> Dataset:
    """Velocity in both directions with a stop in between, force with a bias and white noise."""
    rng = np.random.default_rng(seed)
    t = 1e-3 * np.arange(n)
    v = 0.08 * np.sin(2 * np.pi * t / t[-1]) * (1 + 0.5 * np.sin(23 * t))
    force = np.asarray(TRUTH.force(v, 1.0)) + 0.3 * (seed % 3 - 1) + noise * rng.standard_normal(n)
    return Dataset.of(t=t, v=v, force=force, name=f"{name} {seed}")


def make(
    law: Law | str = "stribeck", records: int = 2, starts: int = 4, n: int = 1500,
    findings: tuple[Finding, ...] = (), call: str = "",
) -> Fitted:  # fmt: skip
    """A fit of `law` to records of `TRUTH`."""
    data = record(1, n)
    for k in range(1, records):
        data = data + record(k + 1, n)
    kind = ForceUnderVelocity()
    what = subject(law, points=True, v_max=0.1)
    residuals = kind.prepare(what, data)
    unknowns = unknowns_of((*what.unknowns, *residuals.own), what.ties, residuals.names)
    problem = task(residuals, unknowns)
    rng = np.random.default_rng(0)
    w0 = unknowns.of({"mu_s": 25.0, "mu_d": 18.0, "v_s": 0.02, "sigma_2": 100.0})
    ends = many_starts(
        problem, [w0 + k * rng.standard_normal(w0.size) for k in range(starts)], agree=0
    )
    best = best_of(ends)
    problem = problem.with_noise(best.noise)
    point = problem.at(best.w)
    if isinstance(point, str):
        raise ValueError(point)
    live = Live(kind, what, data, problem, point, None)
    verdict = judge(live.minimum)
    status = verdict.status(best.status)
    some = tried(problem, ends)
    return fitted(live, some, verdict, findings, status=status, seconds=0.1, call=call)


def evaluated(rows: Residuals, values: NDArray[np.float64]) -> Evaluation:
    """Residuals and derivatives, which exist there."""
    found = rows.at(values)
    assert not isinstance(found, str), found
    return found


def check_slopes(
    rows: Residuals, values: NDArray[np.float64], least: float = 1e-4, rtol: float = 1e-5
) -> None:
    """Derivatives against central differences, value by value."""
    J = evaluated(rows, values).J
    for k, x in enumerate(values):
        d = 1e-5 * max(abs(float(x)), least) * np.eye(values.size)[k]
        change = evaluated(rows, values + d).r - evaluated(rows, values - d).r
        slope = change / (2 * d[k])
        for c in rows.channels:
            size = max(float(np.abs(slope[c.rows]).max()), 1e-3)
            got, expected = J[c.rows, k], slope[c.rows]
            np.testing.assert_allclose(got, expected, atol=rtol * size, err_msg=rows.names[k])
