"""What would make an answer better comes in its order."""

from dataclasses import replace

from posteriors import single

from hdcal.calibration.document import next_steps
from hdcal.inference.checks import PLAUSIBLE, Check
from hdcal.inference.residuals import residuals


def test_what_no_gear_is_believed_to_be_is_looked_at_first():
    posterior = single(size=200)
    left = residuals(posterior)
    plain = next_steps(posterior, left)
    assert not any("units" in step for step in plain)
    for outcome, first in (("warning", True), ("passed", False)):
        check = Check(PLAUSIBLE, outcome, "K = 2e+03, expected 0.5 to 8")
        found = next_steps(replace(posterior, checks=(check,)), left)
        assert found[0].startswith("First look at the units") is first
        assert found[first:] == plain
