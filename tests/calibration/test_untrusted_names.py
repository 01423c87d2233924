"""A name from a file is only text, in the page and in the figures."""

from dataclasses import replace
from xml.etree import ElementTree

import pytest
from hostile_names import NAMES
from posteriors import single
from slices import slice_of

from hdcal.calibration.calibration import calibration_of
from hdcal.data.prior import Prior
from hdcal.inference.posterior import Posterior
from hdcal.report.charts.chart_drawing import images


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    return single(size=200)


def renamed(posterior: Posterior, name: str) -> Posterior:
    """Return the posterior with a name in every place that a file can name."""
    case = posterior.case
    gear = replace(case.gear, name=name, material=name)
    case = replace(case, name=name, gear=gear, notes=(name,), run_labels=(name,))
    old = posterior.priors["K"]
    prior = Prior(old.family, old.numbers, old.unit, name)
    return replace(posterior, case=case, priors={**posterior.priors, "K": prior})


@pytest.mark.parametrize("name", slice_of(NAMES, NAMES[:1]))
def test_names_are_only_text(name: str, posterior: Posterior):
    found = calibration_of(renamed(posterior, name))
    for chart in found.charts().values():
        tree = ElementTree.fromstring(images(chart, name)["svg"])
        tags = {element.tag.rpartition("}")[2] for element in tree.iter()}
        assert not tags & {"script", "img", "foreignObject", "a"}
    page = found.page(command=name)
    # Data of the figures, and the script of the page.
    assert page.count("<script") == page.count("</script>") == 3
    assert "<img src=x" not in page and "<!--" not in page
    assert "\x00" not in page and "\x1b" not in page and "49" + "{%" not in page
    assert page.count("<title>") == page.count("</title>") == 1
    found.to_json()
    cell = found._repr_html_()
    assert "<script" not in cell and "<img src=x" not in cell
    assert not set(found.text()) & {"\x00", "\x1b", "\x07", "\u202e"}
