"""Fits to look at: right, wrong, of one and of several records."""

import numpy as np

from identification.data.dataset import Dataset
from identification.data.findings import Finding
from identification.result.build import fitted
from identification.result.fitted import Fitted
from identification.solving.many_starts import best_of, many_starts
from identification.solving.task import task
from identification.unknowns.subject import subject
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import covariance_of
from identification.verdict.judge import judged
from identification.verdict.minimum import Minimum
from symfric.laws import Law, Stribeck
from tests.identification.result.made import ForceUnderVelocity

TRUTH = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, delta=2.0, sigma_2=200.0, v_eps=1e-4)


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
    tried = many_starts(
        problem, [w0 + k * rng.standard_normal(w0.size) for k in range(starts)], agree=0
    )
    best = best_of(tried)
    problem = problem.with_noise(best.noise)
    point = problem.at(best.w)
    if isinstance(point, str):
        raise ValueError(point)
    end = Minimum(
        residuals.channels, unknowns.unknowns, residuals.names, point.values, point.slope,
        unknowns.at_bound(point.w), point.r, point.J, np.ones(point.r.size), point.evaluation.r, {},
    )  # fmt: skip
    verdict = judged(end)

    def trace(values: np.ndarray) -> float:
        there = residuals.at(values)
        return (
            float("inf")
            if isinstance(there, str)
            else float(np.abs(there.r - point.evaluation.r).max())
        )

    return fitted(
        kind, what, data, problem, point, tried, verdict, covariance_of(end, trace), findings,
        status=verdict.status(best.status), seconds=0.1, call=call,
    )  # fmt: skip
