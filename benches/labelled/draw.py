"""Random dimensions, and the list of families."""
import numpy as np

FAMILIES = []


def family(times):
    """Registers a family of which `times` parts are drawn."""

    def keep(make):
        FAMILIES.append((make.__name__, make, times))
        return make

    return keep


class Draw:
    """Dimensions of one part: the same for the same seed, whatever other families there are."""

    def __init__(self, seed, name, number):
        self.random = np.random.default_rng([seed, number, *name.encode()])

    def __call__(self, low, high):
        return round(float(self.random.uniform(low, high)), 2)

    def whole(self, low, high):
        return int(self.random.integers(low, high + 1))

    def one_of(self, *choices):
        return choices[self.random.integers(len(choices))]
