"""In whatever coordinates: the sampled density is that of priors and likelihood."""

import numpy as np
import pytest
from gauged import certified
from rigs import make_case, make_gear, make_records
from slices import slice_of
from stated_density import base_places, off_the_stated_density
from structures import form_of

from hdcal import EFFECTS
from hdcal.data.gear_file.certificates import GAUGE_UNITS
from hdcal.data.priors import Prior, effect_priors
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.serial_correlation import CORRELATION

NAMES = ["E0", "K", "alpha", "force_offset", "deformation_offset", "sigma"]
ALONE = {"noise_correlation": Prior("fixed", (0.0,))}
X = np.linspace(0.02, 0.54, 40)


def rows(x=X):
    rng = np.random.default_rng(9)
    return make_records(x, 205.0 * x - 1.0 + rng.normal(0.0, 0.3, len(x)))


def kinds() -> dict:
    """Return case, effects, names of parameters, and places in the coordinates."""
    rng = np.random.default_rng(0)

    def places(scale=1.0):
        return scale * rng.normal(size=8)

    plain = {**base_places(rng), "deformation_offset": places(0.02)}
    slack = {**plain, "_corner": plain["deformation_offset"], "sigma": places()}
    del slack["deformation_offset"]
    gauges = {name: places(1e-3) for name in GAUGE_UNITS}
    return {
        "correlated, growing": (
            make_case(rows()),
            ("heteroscedastic_noise",),
            [*NAMES, CORRELATION, "heteroscedastic_noise.share"],
            {
                **plain,
                CORRELATION: places(),
                "_added_sd": places(),
                "_heteroscedastic_noise.share": places(3.0),
            },
        ),
        "correlated": (
            make_case(rows(), certified()),
            (),
            [*NAMES, *GAUGE_UNITS, CORRELATION],
            {**plain, **gauges, CORRELATION: places(), "_added_sd": places()},
        ),
        "slack": (
            make_case(rows(), make_gear(reading="diametral", **ALONE)),
            ("seating_slack",),
            [*NAMES, "seating_slack.clearance"],
            {**slack, "_seating_slack.clearance": places(3.0)},
        ),
        "far": (
            make_case(rows(X + 80.0), make_gear(**ALONE)),
            (),
            NAMES,
            {**plain, "sigma": places()},
        ),
    }


def off(kind: str) -> np.ndarray:
    """Return by how much the sampled density is off, at random places, one removed."""
    case, names, parameters, places = kinds()[kind]
    effects = tuple(EFFECTS[name] for name in names)
    form = form_of(case, effects)
    problem = build_problem(case, effect_priors(), effects, structure=form)
    return off_the_stated_density(problem, parameters, places)


@pytest.mark.parametrize("kind", slice_of(kinds(), ["correlated", "far"]))
def test_the_density_is_that_of_the_stated_priors(kind: str):
    # Far from the data the densities themselves reach 1e6.
    np.testing.assert_allclose(off(kind), 0.0, atol=1e-4)
