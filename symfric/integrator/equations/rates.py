"""The rate of an input: a measured position as the velocity that a model takes."""

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.integrator.equations.inputs import KINDS, Hold, Input, Linear, Sampled


def rate_of(signal: Input) -> Input:
    """The derivative of an input in time, exactly that of what is between its samples.

    A number has the rate 0, a function its derivative, and `Linear` samples the slopes between them
    as `Hold`, 0 before the first and after the last sample.

    Raises:
        ValueError: `Hold` samples, which jump, or what is no input.
    """
    if isinstance(signal, Linear):
        t, values = np.asarray(signal.t), np.asarray(signal.values)
        if t.size < 2:
            return 0.0
        slopes = np.diff(values) / np.diff(t)
        still = np.zeros((*values.shape[:-1], 1))
        before = t[0] - (t[1] - t[0])
        return Hold(np.r_[before, t], np.concatenate([still, slopes, still], axis=-1))
    if isinstance(signal, Sampled):
        raise ValueError(
            "rate_of: expected a signal without jumps, got Hold samples; Linear(t, values) goes "
            "straight from one to the next"
        )
    if is_number(signal):
        return 0.0
    function = checks.function("rate_of", signal, KINDS)

    def rate(t: ca.SX) -> ca.SX:
        return ca.jtimes(ca.SX(function(t)), t, ca.SX(1))

    return rate
