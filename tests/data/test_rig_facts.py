"""What is known of a rig sharpens the priors that it speaks of, and no others."""

import numpy as np
import pytest
from scipy import signal

from hdcal.data.gear import read_gear
from hdcal.data.gear_file.rig_facts import rows_of_half_cycle
from hdcal.data.priors import rig_priors
from hdcal.data.reading import read_case
from hdcal.errors import InputError

SPRING = '[gear]\ntheory = "spring"\n'
FACTS = """
[rig]
load_cell_capacity_N = 200.0
gauge_range_mm = 5.0
displacement_pitch_mm = 0.5
filter_Hz = 2.0
"""


def gear_of(folder, text):
    path = folder / "gear.toml"
    path.write_text(text, "utf-8")
    return read_gear(path)


def correlation_of(folder, text, header="deformation_mm,force_N,time_s", step=0.05):
    """Return the prior of neighbours' correlation of a case of 20 rows."""
    gear_of(folder, text)
    rows = [(0.01 * i, 2.0 * i, step * i)[: header.count(",") + 1] for i in range(20)]
    lines = [header, *(",".join(map(repr, row)) for row in rows)]
    (folder / "data.csv").write_text("\n".join(lines), "utf-8")
    return read_case(folder).gear.scale_priors["noise_correlation"]


@pytest.mark.parametrize(("reading", "radial"), [("radial", 1.0), ("diametral", 0.5)])
def test_each_fact_sharpens_its_own_prior(tmp_path, reading, radial):
    measured = f'[measurement]\ndeformation = "{reading}"\n'
    found = gear_of(tmp_path, SPRING + measured + FACTS).effect_priors
    assert sorted(found) == [
        "displacement_nonlinearity.curvature",
        "force_saturation.curvature",
        "screw_error.pitch",
    ]
    # At capacity the cell loses the share that shipped priors have it lose at 100 N.
    lost = found["force_saturation.curvature"].numbers[0] * 200.0**2
    assert lost == pytest.approx(8e-7 * 100.0**2)
    bent = found["displacement_nonlinearity.curvature"].numbers[1] * 5.0 * radial
    assert bent == pytest.approx(0.04 * 0.5)
    assert found["screw_error.pitch"].numbers[0] == pytest.approx(0.5 * radial)
    assert all("[rig]" in prior.source for prior in found.values())


def test_priors_that_are_given_win(tmp_path):
    own = (
        '[priors.screw_error]\npitch = { family = "fixed", value = 0.3, unit = "mm" }\n'
    )
    found = gear_of(tmp_path, SPRING + FACTS + own).effect_priors
    assert found["screw_error.pitch"].numbers == (0.3,)
    given = '[priors]\nnoise_correlation = { family = "fixed", value = 0.1 }\n'
    assert correlation_of(tmp_path, SPRING + FACTS + given).numbers == (0.1,)


def test_noise_behind_a_filter_errs_alike_as_the_prior_expects(tmp_path):
    fine, every = 1e-4, 500
    noise = np.random.default_rng(3).normal(size=4_000_000)
    behind = signal.lfilter([1.0], [1.0, -np.exp(-2 * np.pi * 2.0 * fine)], noise)
    seen = np.corrcoef(behind[:-every:every], behind[every::every])[0, 1]
    a, b = correlation_of(tmp_path, SPRING + FACTS).numbers
    likely = np.exp(-2 * np.pi * 2.0 * 0.05)
    assert seen == pytest.approx(likely, abs=0.03)
    assert a / (a + b) == pytest.approx(likely, abs=0.06)


def test_without_a_clock_a_filter_says_nothing(tmp_path):
    without = correlation_of(tmp_path, SPRING + FACTS, "deformation_mm,force_N")
    assert without.family == rig_priors()["noise_correlation"].family == "uniform"


def test_a_half_cycle_is_the_way_between_two_turns():
    up = np.linspace(0.0, 1.0, 21)
    path = np.concatenate([up, up[-2::-1], up[1:]])
    rows = rows_of_half_cycle(path, np.zeros(len(path), int))
    assert rows == pytest.approx(20.0, abs=1.0)
    twice = np.tile(path, 2)
    assert rows_of_half_cycle(twice, np.repeat([0, 1], len(path))) == rows


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("load_cell_capacity_N = -3.0", "does not lie"),
        ("gauge_range_mm = 0.0", "does not lie"),
        ("filter_Hz = inf", "finite"),
        ('displacement_pitch_mm = "0.5"', "number"),
        ("gauge_rage_mm = 5.0", "'gauge_range_mm'"),
    ],
)
def test_a_wrong_fact_is_refused_at_its_key(tmp_path, wrong, words):
    with pytest.raises(InputError) as refused:
        gear_of(tmp_path, SPRING + "[rig]\n" + wrong)
    (finding,) = refused.value.findings
    assert finding.row == 4 and words in str(finding)
