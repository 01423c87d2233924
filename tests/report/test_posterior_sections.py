"""A page, a terminal and JSON say the same of a posterior."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import plain_draws, ramp_case, single, written_posterior
from rich.console import Console
from rigs import make_gear

from hdcal.data.prior import Prior
from hdcal.inference.checks import Check
from hdcal.report.document import Document, Tag
from hdcal.report.html import html_page
from hdcal.report.intervals import Interval
from hdcal.report.parameters import parameter_estimates
from hdcal.report.plain import as_plain
from hdcal.report.posterior_answer import posterior_entries
from hdcal.report.posterior_sections import (
    check_section,
    parameter_section,
    parameter_table,
    prior_section,
)
from hdcal.report.terminal import terminal_lines
from hdcal.report.words import estimate


def shown(*sections) -> tuple[str, str]:
    """Return what a page and a terminal show of sections."""
    document = Document("gear", "test", "some words", "Done.", sections=sections)
    images = dict.fromkeys(("priors", "sampler"), b"<svg/>")
    terminal = Console(width=110, highlight=False)
    with terminal.capture() as caught:
        terminal.print(*terminal_lines(document), sep="\n")
    return html_page(document, images), caught.get()


def test_a_terminal_has_room_for_fewer_columns():
    section = parameter_section(parameter_estimates(single()))
    page, words = shown(section)
    assert ">gained from data<" in page and "gained from data" not in words
    for title in ("driven by", "R-hat", "ESS bulk / tail", "influence coefficient K"):
        assert title in page and title in words
    _, without = shown(replace(section, brief=False))
    assert "influence coefficient K" not in without


def test_a_fixed_parameter_was_not_sampled():
    case = ramp_case(make_gear(K=Prior("fixed", (2.6,))))
    posterior = written_posterior(case, plain_draws(case))
    sampled = {n: d for n, d in posterior.diagnoses.items() if n != "K"}
    found = parameter_estimates(replace(posterior, diagnoses=sampled))
    assert list(found)[-1] == "K"
    plain = as_plain(found["K"])
    assert plain["rhat"] is plain["ess_bulk"] is plain["prior_sensitivity"] is None
    assert (plain["driven_by"], plain["contraction"]) == ("prior", 0.0)
    row = parameter_table(found).rows[-1]
    assert row[4:] == [Tag("prior", "caution"), "0%", "–", "– / –"]


def test_an_estimate_is_in_the_units_of_people():
    posterior = single()
    found = parameter_estimates(posterior)["E0"]
    assert found.unit == "GPa"
    assert found.median == pytest.approx(np.median(posterior.draws["E0"]) / 1e3)


def test_an_interval_of_equal_draws_is_told_as_one_number():
    at = 0.3988177
    assert estimate(Interval(at, at, at + 1e-16)) == ("0.3988", "0.3988 … 0.3988")


def test_outcomes_differ_by_colour_and_words():
    outcomes = ("passed", "note", "warning", "failed")
    checks = [Check(f"check {n}", n, f"found {n}") for n in outcomes]
    table = check_section(checks).blocks[0]
    tones = [row[1].tone for row in table.rows]
    assert tones == ["good", "neutral", "caution", "bad"]
    page, _ = shown(check_section(checks))
    assert all(f">{outcome}</span>" in page for outcome in outcomes)


def test_a_prior_is_told_with_its_source():
    posterior = single()
    page, _ = shown(prior_section(posterior))
    assert "a factor of" in page and "believed before the data" in page
    (row,) = (r for r in prior_section(posterior).blocks[0].rows if "E₀" in r[0])
    assert row[2] == (posterior.priors["E0"].source or "the gear file")


def test_checks_become_warnings_remarks_and_reasons():
    checks = tuple(
        Check("by hand", outcome, f"said {outcome}")
        for outcome in ("passed", "note", "warning", "failed")
    )
    found = posterior_entries(replace(single(), checks=checks), "", ())
    assert found["status"] == "failed"
    assert found["reasons"] == ("by hand: said failed",)
    assert found["warnings"] == ("Said warning",)
    assert found["flat_directions"] == ("said note",)
