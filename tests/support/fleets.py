"""A fleet made by hand: what is said of it hangs on no sampler."""

from dataclasses import replace

import numpy as np
from rigs import make_gear

from hdcal.data.reading import read_case
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.misfit import Misfit
from hdcal.fleets.readings import fleet_readings
from hdcal.inference.checks import Check


def handmade() -> Fleet:
    """Return four gears of which the last is called off."""
    rng = np.random.default_rng(0)
    x = np.tile(np.linspace(0.0, 0.5, 5), 4)
    columns = {"deformation_mm": x, "force_N": 200.0 * x}
    case = read_case(columns | {"specimen": np.repeat(list("ABCD"), 5)})
    truth = np.array([199.0, 200.0, 201.0, 180.0])
    draws = {
        "stiffness": rng.normal(200.0, 0.5, 400),
        "zero": rng.normal(0.0, 0.1, 400),
        "specimen_sd": rng.uniform(0.005, 0.01, 400),
        "run_offset_sd": rng.uniform(0.5, 1.5, 400),
        "sigma": rng.uniform(0.4, 0.6, 400),
        "noise_spread": rng.uniform(0.0, 0.1, 400),
        "off_share": rng.uniform(0.0, 0.1, 400),
        "off_ratio": rng.uniform(4.0, 8.0, 400),
    }
    return Fleet(
        readings=fleet_readings(replace(case, gear=make_gear())),
        draws=draws,
        stiffness=truth + rng.normal(0.0, 0.3, (40, 4)),
        size_ratio=np.ones(4),
        apart=(truth + rng.normal(0.0, 0.3, (40, 4))) / 200.0 - 1.0,
        noise_sd=np.full(4, 0.5),
        own_noise_sd=np.full(4, 0.5),
        zero=np.zeros(4),
        distance=np.array([-0.7, 0.0, 0.7, -14.0]),
        off=np.array([0.01, 0.01, 0.01, 0.999]),
        chances={
            "stiffness": np.array([0.5, 1.0, 0.5, 1e-6]),
            "noise": np.ones(4),
            "zero": np.ones(4),
            "shape": np.ones(4),
        },
        loop=np.full(4, np.nan),
        bend=np.zeros(4),
        off_in={
            "stiffness": np.array([False, False, False, True]),
            "noise": np.zeros(4, bool),
            "zero": np.zeros(4, bool),
            "shape": np.zeros(4, bool),
        },
        next_stiffness=rng.normal(200.0, 2.0, 400),
        unit=80.0,
        misfit=Misfit(0.0, 0.0, 0.0),
        lots=[],
        operators=[],
        rigs=[],
        force_tolerance=None,
        checks=(Check("chains agree (R-hat)", "passed", "the largest R-hat is 1.0"),),
        settings={
            "sampler": "NUTS",
            "seed": 0,
            "chains": 2,
            "warmup": 500,
            "draws": 200,
        },
    )
