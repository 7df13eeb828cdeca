"""The end of a fit as if it had been made: values at will, told or not."""

import numpy as np

from panto_env.fitting.fit import Fit
from panto_env.fitting.misfit import State
from panto_env.fitting.solve import Solution


def made_up(ready, differences, shift=0.0, silent=()):
    """A fit that found differences of values by name, and tells them, but for silent ones."""
    fitting = ready.fitting
    start = fitting.start()
    x, deviation = start.x.copy(), fitting.prior.copy()
    for k, value in enumerate(fitting.values.all):
        if value.name in differences:
            x[k] = differences[value.name]
            deviation[k] *= 1.0 if value.name in silent else 0.1
    x[len(fitting.values) :][: len(fitting.parts)] = shift
    state = State(x, start.static_forces, np.ones_like(start.noise), 3)
    random = np.random.default_rng(0)
    left = tuple(random.standard_normal(len(part.measured.kept)) for part in fitting.parts)
    return Fit(ready, Solution(state, np.diag(deviation**2), (), left, True))
