"""A certificate is one printed page, says what it is, and is none of a failure."""

import csv
import io
import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest
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
from hdcal.versions import versions

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
def plain() -> tuple[MarginAnswer, hdcal.Posterior]:
    """Return the margin of one gear, and its calibration."""
    posterior = single(size=400)
    found = hdcal.margin(posterior, 0.4, **ASKED)
    return margin_answer(found, posterior, seed=3), posterior


def read(page: str, folder: Path) -> None:
    """Require a page to ask nothing of the network and to fit on its paper."""
    (folder / "certificate.html").write_text(page, "utf-8")
    seen = look(folder / "certificate.html", folder)
    assert not seen.requests and not seen.complaints
    assert seen.frames["paper"]["width"] <= PAPER, seen.frames["paper"]["past"]


@pytest.mark.thorough
def test_the_longest_certificate_is_one_page(tmp_path: Path):
    read(certificate_page(*full(), ISSUED), tmp_path)
    assert print_pages(tmp_path / "certificate.html", tmp_path) == 1


def test_nothing_is_asked_of_the_network_and_nothing_is_cut(plain, tmp_path):
    read(certificate_page(*plain, ISSUED), tmp_path)


def words_of(page: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", " ", page.partition("<body")[2]).split())


def test_it_says_what_a_certificate_has_to_say(plain):
    found, posterior = plain
    words = words_of(certificate_page(found, posterior, ISSUED))
    for said in (
        posterior.case.gear.name,
        posterior.case.data_sha256,
        f"k = {found.coverage_factor:.2f}",
        f"hdcal {versions()['hdcal']}, seed 3",
        found.decision.words,
        "2026-11-22",
    ):
        assert said in words, said


def test_a_temperature_that_nobody_measured_is_not_called_tested(plain):
    found, posterior = plain
    records = posterior.case.records
    for known, said in ((set(), False), ({"temperature"}, True)):
        case = replace(posterior.case, records=replace(records, known=frozenset(known)))
        own = replace(posterior, case=case)
        words = words_of(certificate_page(found, own, ISSUED))
        assert ("temperature and direction lie within" in words) == said
        assert ("temperature of the test was not measured" in words) != said


def test_there_is_none_of_a_calibration_that_failed():
    posterior = single(size=200)
    found = hdcal.margin(posterior, 0.4, sensitivities=False)
    failed = replace(posterior, checks=(Check("r_hat", "failed", "is 1.5"),))
    with pytest.raises(NotUsable, match="must not be used"):
        margin_report(found, failed, certificate=ISSUED)


def test_the_command_writes_it_beside_the_report(here: Hdcal, tmp_path: Path):
    (tmp_path / "run").mkdir()
    single(size=400).save(tmp_path / "run" / "posterior.nc")
    asked = ["--deformation", "0.4", "--limit-force", "90", "--rule", "simple"]
    refused = here("margin", "run", *asked, "--certificate")
    assert refused.returncode == 2
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


def test_no_cell_of_the_table_is_a_formula(plain):
    posterior = plain[1]
    found = hdcal.margin(posterior, 0.4)
    wild = replace(found.budget[0], component="=1+1", halved_by="@SUM(A1)")
    report = margin_report(replace(found, budget=(wild,)), posterior)
    (row,) = csv.DictReader(io.StringIO(columns_csv(report.tables()["budget.csv"])))
    assert (row["component"], row["halved_by"]) == ("'=1+1", "'@SUM(A1)")
