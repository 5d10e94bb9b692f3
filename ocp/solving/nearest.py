"""The control next to a given one under which a motion does what is asked for.

    min 1/2 sum_k h_k |u_k - u*_k|^2   subject to the rows of the program

The rows are nearly met at the start, so their multipliers are small and with them all curvature of
the model: what makes an optimum hard to find, kinks of a friction law, plays no part. Where u* is
optimal for a similar model, the cost differs from the least one by terms of second order in the
difference of the models.
"""

from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.transcription.program import Program
from ocp.transcription.transcription import Transcription


def nearest(transcription: Transcription, w: ArrayLike) -> Program:
    """The program of `transcription` with the distance from the controls in `w` as its cost.

    Free durations and chosen parameters count like inputs; everything is scaled.
    """
    program, layout = transcription.program, transcription.layout
    weights = np.zeros(layout.size)
    for span, mesh in zip(layout.spans, transcription.meshes, strict=True):
        weights[span.u] = np.diff(mesh)
        if span.T >= 0:
            weights[span.T] = 1.0
    weights[layout.chosen] = 1.0
    scale, there = ca.DM(weights), ca.DM(np.asarray(w, dtype=float))
    x, p = ca.MX.sym("x", program.w.numel()), ca.MX.sym("p", program.p.numel())
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", program.g.numel())
    curved = ca.MX(program.hessian(x, p, 0.0, lam_g))
    hessian = ca.triu(curved + lam_f * ca.diag(scale))
    return replace(
        program,
        f=_half_square(program.w, there, scale),
        gradient=ca.Function(
            "gradient", [x, p], [_half_square(x, there, scale), scale * (x - there)]
        ),
        hessian=ca.Function("hessian", [x, p, lam_f, lam_g], [hessian]),
    )


def _half_square(w: ca.MX, there: ca.DM, scale: ca.DM) -> ca.MX:
    return ca.dot(scale, (w - there) ** 2) / 2
