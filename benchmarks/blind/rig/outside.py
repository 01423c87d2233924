"""The mechanisms that are in no library, by name.

Each gives an additive error of the force of the order of 1 N; size and sign are the
caller's. Places, moments and rates are drawn as shares of the stroke, the run or the
record, so that each falls inside the record. The right answer to each of them is that
the cause is unknown.
"""

import inspect
from collections.abc import Callable

import numpy as np

from benchmarks.blind.rig import (
    outside_contact,
    outside_loops,
    outside_record,
    outside_sensor,
    outside_temperature,
)
from benchmarks.blind.rig.history import Floats, History

OutsideMechanism = Callable[[History, np.random.Generator], Floats]
_MODULES = (
    outside_contact,
    outside_loops,
    outside_temperature,
    outside_sensor,
    outside_record,
)
# Every public function of these modules is a mechanism.
OUTSIDE: dict[str, OutsideMechanism] = {
    name: function
    for module in _MODULES
    for name, function in inspect.getmembers(module, inspect.isfunction)
    if function.__module__ == module.__name__ and not name.startswith("_")
}
