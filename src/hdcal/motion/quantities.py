"""The quantities of a gear that moves, as a table."""

from collections.abc import Mapping

from hdcal.report.document import Cell, Table
from hdcal.report.intervals import Interval
from hdcal.report.posterior_sections import driver_tag
from hdcal.report.words import estimate, unit

# Quantity of an answer -> what it is called and its unit.
QUANTITIES = {
    "natural_frequency_Hz": ("natural frequency", "Hz"),
    "damped_frequency_Hz": ("frequency with damping", "Hz"),
    "damping_ratio": ("damping ratio ζ", "1"),
    "damping_N_s_per_mm": ("damping c", "N·s/mm"),
    "mass_kg": ("moved mass m", "kg"),
    "stiffness_N_per_mm": ("stiffness k", "N/mm"),
    "peak_mm": ("largest deformation", "mm"),
}


def quantity_table(
    found: Mapping[str, Interval], driven_by: Mapping[str, str] | None = None
) -> Table:
    """Return quantities as a table.

    Args:
        found: by their names in `QUANTITIES`; not all need be there.
        driven_by: who decided each of them, if that is to be told.
    """
    numbers = ["median", "95 % interval"]
    columns = ["quantity", *numbers, "unit"]
    columns += ["decided by"] * (driven_by is not None)
    rows: list[list[Cell]] = []
    for name, (words, code) in QUANTITIES.items():
        if name in found:
            rows.append([words, *estimate(found[name]), unit(code)])
            if driven_by is not None:
                rows[-1].append(driver_tag(driven_by[name]))
    return Table(columns, rows, frozenset(numbers))
