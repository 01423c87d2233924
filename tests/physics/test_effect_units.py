"""Every effect means the same in other units, derived from those it declares."""

import dataclasses

import numpy as np
from effect_bench import every_effect, typical

from hdcal import EFFECTS
from hdcal.data.units import to_code
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import parameters


def rescaling(unit: str, scales: dict[str, float]) -> float:
    """Return by what a number in a code unit grows when the units shrink."""
    unit = "N/mm^2" if unit == "MPa" else unit
    above, *below = unit.split("/")
    factor = 1.0
    for sign, parts in ((1, above.split("*")), (-1, below)):
        for part in parts:
            symbol, _, power = part.partition("^")
            if symbol != "1":
                factor *= scales[symbol] ** (sign * int(power or 1))
    return factor


@every_effect
def test_units_do_not_matter(name, scattered, base, reading):
    """The same rig written in other units of length, force, time and temperature.

    Lengths in micrometres against nanometres: rounded corners are given in mm and
    are at most 1e-4, so on both scales below 1e-6 of these deformations.
    """
    records = scattered(5)
    size = np.sign(records.deformation) * (0.1 + np.abs(records.deformation))
    records = dataclasses.replace(records, deformation=size)

    def written(mm, newton, second, kelvin):
        scales = {"mm": mm, "N": newton, "s": second, "K": kelvin}

        def number(value, unit):
            return value * rescaling(unit, scales)

        seen = dataclasses.replace(
            records,
            deformation=number(records.deformation, "mm"),
            temperature=number(records.temperature, "K"),
            time=number(records.time, "s"),
            rate=number(records.rate, "mm/s"),
            force_sd=number(records.force_sd, "N"),
        )
        units = ("N/mm", "1/K", "mm", "N", "N")
        fields = [getattr(base, field.name) for field in dataclasses.fields(base)]
        moved = Base(*(number(v, u) for v, u in zip(fields, units, strict=True)))
        sizes = {
            field: number(about.typical, to_code(about.unit)[1])
            for field, about in parameters(EFFECTS[name]).items()
        }
        mean, noise = predict_reading(
            moved,
            [typical(name, **sizes)],
            seen,
            Reading(1.0, number(reading.reference_temperature, "K")),
        )
        return mean / newton, noise.sd / newton, noise.log_weight

    first = written(1e3, 1.0, 1.0, 1.0)
    # No product of these is one by chance.
    other = written(1e6, 7.0, 60.0, 1.8)
    for one, two in zip(first, other, strict=True):
        np.testing.assert_allclose(two, one, rtol=2e-6, atol=1e-9)
