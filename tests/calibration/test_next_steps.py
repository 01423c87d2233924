"""What would make an answer better comes in its order."""

from dataclasses import replace

from posteriors import single

from hdcal.calibration.document import next_steps
from hdcal.inference.checks import PLAUSIBLE, SUSPECT, Check
from hdcal.inference.residuals import residuals


def test_what_no_gear_is_believed_to_be_is_looked_at_first():
    posterior = single(size=200)
    left = residuals(posterior)
    plain = next_steps(posterior, left)
    assert not any("units" in step for step in plain)
    far = "outliers.ratio = 20, expected 2 to 12"
    for words, first in ((f"K = 2e+03. {SUSPECT}", True), (far, False)):
        check = Check(PLAUSIBLE, "warning", words)
        found = next_steps(replace(posterior, checks=(check,)), left)
        assert found[0].startswith("First look at the units") is first
        assert found[first:] == plain
