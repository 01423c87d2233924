"""A certificate is one printed page, says what it is, and is none of a failure."""

import csv
import io
import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest
from benchmarks.certificates import gear_of
from browser import PAPER, look, print_pages
from commands import Hdcal
from posteriors import batch, single, stiffer

import hdcal
from hdcal.errors import NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.margin.answer import MarginAnswer
from hdcal.prediction.margin.certificate import certificate_page
from hdcal.prediction.margin.summary import margin_answer, margin_report
from hdcal.report.table_files import columns_csv

ISSUED = date(2026, 11, 22)
ASKED = {"limit_force": 90.0}


def full() -> tuple[MarginAnswer, hdcal.Posterior]:
    """Return the longest certificate: every source, far outside what was tested."""
    gears = batch(6, 400)
    gear = replace(gears.case.gear, name="a gear with a name of many words " * 6)
    named = replace(gears, case=replace(gears.case, gear=gear))
    sizes = dict.fromkeys(("wall_thickness_mm", "radius_mm", "length_mm"), 0.02)
    asked = {
        "tolerances": sizes,
        "temperature": [-20.0, 20.0, 80.0],
        "content": 0.99999,
    }
    models = [(0.6, named), (0.4, stiffer(named, 1.05))]
    found = hdcal.margin(models, 0.8, limit_force=190.0, direction="down", **asked)
    return margin_answer(found, named), named


@pytest.fixture(scope="module")
def longest(tmp_path_factory) -> Path:
    page = tmp_path_factory.mktemp("longest") / "certificate.html"
    page.write_text(certificate_page(*full(), ISSUED), "utf-8")
    return page


@pytest.mark.thorough
def test_the_longest_certificate_is_one_page(longest: Path, tmp_path: Path):
    assert print_pages(longest, tmp_path) == 1


def test_nothing_is_asked_of_the_network_and_nothing_is_cut(longest: Path, tmp_path):
    seen = look(longest, tmp_path)
    assert not seen.requests and not seen.complaints
    assert seen.frames["paper"]["width"] <= PAPER, seen.frames["paper"]["past"]


def words_of(page: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", " ", page.partition("<body")[2]).split())


def test_it_says_what_a_certificate_has_to_say():
    posterior = single(size=400)
    found = margin_answer(hdcal.margin(posterior, 0.4, **ASKED), posterior, seed=3)
    words = words_of(certificate_page(found, posterior, ISSUED))
    for said in (
        "Calibration of a model from measurements. No accreditation",
        posterior.case.gear.name,
        posterior.case.data_sha256,
        "0.4 mm as read, loading, 20 °C",
        "95 % coverage",
        f"k = {found.coverage_factor:.2f}",
        f"hdcal {hdcal_version()}, seed 3",
        "reading noise",
        found.decision.words,
        "Guarded acceptance (ISO/IEC 17025, 7.8.6; ILAC-G8; JCGM 106)",
        "not stated, so no part of U: gain of the load cell, gain of the displacement "
        "gauge, zero of the thermometer",
        "Other gears: nothing here says how much they differ from this one.",
        "2026-11-22 date of issue signature",
    ):
        assert said in words, said
    assert "ISO/IEC 17025 accredited" not in words


@pytest.mark.thorough
def test_it_says_which_certificates_are_part_of_it():
    text = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
    text += "[measurement]\nforce_calibration = { expanded_N = 0.2 }\n"
    posterior = single(gear_of(text), size=400)
    found = margin_answer(hdcal.margin(posterior, 0.4, **ASKED), posterior, seed=3)
    words = words_of(certificate_page(found, posterior, ISSUED))
    assert "part of the model: zero of the load cell; not stated, so no" in words


def test_a_temperature_that_nobody_measured_is_not_called_tested():
    posterior = single(size=400)
    found = margin_answer(hdcal.margin(posterior, 0.4, **ASKED), posterior, seed=3)
    records = posterior.case.records
    for known, said in ((set(), False), ({"temperature"}, True)):
        case = replace(posterior.case, records=replace(records, known=frozenset(known)))
        own = replace(posterior, case=case)
        words = words_of(certificate_page(found, own, ISSUED))
        assert ("temperature and direction lie within" in words) == said
        assert ("temperature of the test was not measured" in words) != said


def hdcal_version() -> str:
    from hdcal.data.versions import versions

    return versions()["hdcal"]


def test_there_is_none_of_a_calibration_that_failed():
    posterior = single(size=200)
    found = hdcal.margin(posterior, 0.4)
    failed = replace(posterior, checks=(Check("r_hat", "failed", "is 1.5"),))
    with pytest.raises(NotUsable, match="must not be used"):
        margin_report(found, failed, certificate=ISSUED)


def test_the_command_writes_it_beside_the_report(here: Hdcal, tmp_path: Path):
    (tmp_path / "run").mkdir()
    single(size=400).save(tmp_path / "run" / "posterior.nc")
    asked = ["--deformation", "0.4", "--limit-force", "90", "--rule", "simple"]
    refused = here("margin", "run", *asked, "--certificate")
    assert refused.returncode == 2
    assert "--certificate: is written into a result folder" in refused.stderr
    done = here("margin", "run", *asked, "--certificate", "--out", "result", "--json")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "result"
    page = (folder / "certificate.html").read_text("utf-8")
    assert date.today().isoformat() in page and "Simple acceptance" in page
    found = json.loads(done.stdout)
    rows = list(csv.DictReader(io.StringIO((folder / "budget.csv").read_text("utf-8"))))
    assert [row["component"] for row in rows] == [
        line["component"] for line in found["budget"]
    ]
    assert sum(float(row["share"]) for row in rows) == pytest.approx(1.0, abs=1e-6)
    assert "Uncertainty budget" in done.stderr and "halved by" in done.stderr
    assert found["decision"]["rule"] == "simple"


def test_no_cell_of_the_table_is_a_formula():
    posterior = single(size=200)
    found = hdcal.margin(posterior, 0.4)
    wild = replace(found.budget[0], component="=1+1", halved_by="@SUM(A1)")
    report = margin_report(replace(found, budget=(wild,)), posterior)
    (row,) = csv.DictReader(io.StringIO(columns_csv(report.tables()["budget.csv"])))
    assert (row["component"], row["halved_by"]) == ("'=1+1", "'@SUM(A1)")
