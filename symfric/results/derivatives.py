"""What a run says of its derivatives, where they were asked for."""

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks

Array = NDArray[np.float64]


class Derivatives:
    """Derivatives of the signals of a run by free parameters and start values.

    Attributes:
        scene, t, units: of the run.
        differentiate, delays, pull_back: what finds them; None where nobody asked for them.
    """

    scene: str
    t: Array
    units: dict[str, str]
    differentiate: Callable[[Array], dict[str, dict[str, Array]]] | None
    delays: Callable[[], dict[str, Array]] | None
    pull_back: Callable[[Mapping[str, Array]], dict[str, float]] | None

    @cached_property
    def sensitivities(self) -> dict[str, dict[str, Array]]:
        """Derivatives at `t`: name as given to `simulate` -> signal -> values, shape (n,).

        They jump where an event moves with the name; at its time they are those behind it.

        Raises:
            ValueError: none were asked for, or an event has none: its expression only touches
                zero, it comes with a jump of an input, or with an event whose order matters.
        """
        if self.differentiate is None:
            raise self._without_derivatives
        return self.differentiate(self.t)

    @cached_property
    def event_sensitivities(self) -> dict[str, Array]:
        """Derivatives of the times of `happened`: name -> [s per unit], shape (events,).

        That of a terminal event is the derivative of the end time. Refused as `sensitivities` is.
        """
        if self.delays is None:
            raise self._without_derivatives
        return self.delays()

    def gradient(self, weights: Mapping[str, ArrayLike]) -> dict[str, float]:
        """Derivatives of the sum over signals s and times t_i of weights[s][i] s(t_i).

        One sweep backwards over the steps, at a cost that does not grow with the number of names
        given to `simulate`. For a cost J of the signals at `t`, the weights are dJ/ds(t_i).

        Args:
            weights: signal -> a number for every time of `t`, or one for all.

        Returns:
            Name as given to `simulate` -> derivative.

        Raises:
            ValueError: no sensitivities were asked for, an unknown signal, another length.
        """
        if self.pull_back is None:
            raise self._without_derivatives
        where = f"trajectory of '{self.scene}'"
        named = checks.named(f"{where}: gradient", weights, self.units)
        given = {
            name: checks.array(f"{where}: gradient: {name}", w, ndim=None)
            for name, w in named.items()
        }
        odd = {name: w.shape for name, w in given.items() if w.shape not in ((), self.t.shape)}
        if odd:
            raise ValueError(
                f"{where}: gradient: expected numbers or arrays of {self.t.size} weights, got "
                + ", ".join(f"{name} of shape {shape}" for name, shape in odd.items())
            )
        return self.pull_back({n: np.broadcast_to(w, self.t.shape) for n, w in given.items()})

    @property
    def _without_derivatives(self) -> ValueError:
        return ValueError(
            f"trajectory of '{self.scene}': expected sensitivities, got none; ask for them by "
            "simulate(..., sensitivities=[...])"
        )
