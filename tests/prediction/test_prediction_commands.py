"""`hdcal predict` and `hdcal margin` as commands, and the certificate."""

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
from posteriors import batch, beside, single, stiffer
from schema_checks import obeys

import hdcal as package
from hdcal.errors import NotUsable
from hdcal.inference.checks import Check
from hdcal.inference.model_average import ModelAverage
from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.result import Bands
from hdcal.prediction.margin.result import Margin

AT = ["--deformation", "0.4"]
FILES = {"margin.json", "budget.csv", "report.html", "hdcal-result.json"} | {
    f"{name}.{kind}" for name in ("margin", "budget") for kind in ("svg", "png")
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result folders: one gear, an ambiguous diagnosis and a failed one."""
    place = tmp_path_factory.mktemp("runs")
    for name in ("one", "two", "failed"):
        (place / name).mkdir()
    single(size=400).save(place / "one" / "posterior.nc")
    gears, names = batch(6, 400), ("progressive_stiffening", "seating_slack")
    models = {names[0]: (0.6, beside(gears, names[0]))}
    models |= {names[1]: (0.4, beside(stiffer(gears, 1.05), names[1]))}
    ModelAverage(models, None).save(place / "two" / "posterior.nc")
    failed = {"schema": "hdcal.verdict/3", "status": "failed", "reasons": ["why"]}
    (place / "failed" / "verdict.json").write_text(json.dumps(failed), "utf-8")
    return place


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_predict_prints_or_writes_the_table(here: Hdcal, runs, tmp_path: Path):
    asked = ["predict", runs / "one", "--deformation", "0.1:0.5:5"]
    done = here(*asked)
    assert done.returncode == 0, done.stderr
    bands = package.predict(Posterior.load(runs / "one"), [0.1, 0.2, 0.3, 0.4, 0.5])
    found = rows(done.stdout)
    assert [row["tested"] for row in found] == ["true"] * 5
    for name in ("physics_lo_N", "physics_median_N", "new_measurement_hi_N"):
        column = [float(row[name]) for row in found]
        assert column == pytest.approx(getattr(bands, name), rel=1e-8)
    answer = json.loads(here(*asked, "--json").stdout)
    obeys(answer, Bands)
    assert answer["columns"]["physics_lo_N"] == pytest.approx(bands.physics_lo_N)
    file = tmp_path / "bands.csv"
    assert here(*asked, "--out", file).stdout == ""
    assert file.read_text("utf-8") == done.stdout


def test_margin_writes_a_folder(here: Hdcal, runs, tmp_path: Path):
    folder = tmp_path / "result"
    asked = ["margin", runs / "two", *AT, "--out", folder]
    more = ["--limit-force", "120", "--given-force", "80", "--rule", "simple"]
    more += ["--temperature", "-20:80", "--tolerance", "wall_thickness_mm=0.02"]
    result = here(*asked, *more, "--certificate", "--json")
    assert result.returncode == 0, result.stderr
    assert {path.name for path in folder.iterdir()} == FILES | {"certificate.html"}
    found = json.loads((folder / "margin.json").read_text("utf-8"))
    assert json.loads(result.stdout) == found
    obeys(found, Margin)
    assert found["population"] == "specimens" and len(found["levels"]) == 11
    assert [*found["causes"].values()] == pytest.approx([0.6, 0.4])
    assert found["decision"]["rule"] == "simple"
    budget = rows((folder / "budget.csv").read_text("utf-8"))
    components = [row["component"] for row in found["budget"]]
    assert [row["component"] for row in budget] == components
    assert sum(float(row["share"]) for row in budget) == pytest.approx(1.0)
    for more, code in (([], 2), (["--force"], 0)):
        assert here(*asked, *more).returncode == code
    assert {path.name for path in folder.iterdir()} == FILES


BAD = {
    "missing folder": (["nowhere", *AT], "nowhere"),
    "deformation in um": (
        ["{one}", "--deformation", "400"],
        "Give the deformation in mm",
    ),
    "no tolerance": (["{one}", *AT, "--tolerance", "thin"], "is not NAME="),
    "certificate without a folder": (["{one}", *AT, "--certificate"], "certificate"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_writes_nothing(here: Hdcal, runs: Path, tmp_path: Path, name: str):
    arguments, words = BAD[name]
    given = [text.format(one=runs / "one") for text in arguments]
    place = [] if "--certificate" in given else ["--out", "result"]
    result = here("margin", *given, *place)
    assert result.returncode == 2, result.stderr
    assert words in " ".join(result.stderr.split())
    assert result.stdout == "" and list(tmp_path.iterdir()) == []


def test_all_faults_of_a_command_line_are_found_at_once(here: Hdcal):
    asked = ["--deformation", "x", "--temperature", "warm", "--out", "a/b/c"]
    result = here("predict", "nowhere", *asked)
    assert result.returncode == 2 and result.stdout == ""
    assert all(part in result.stderr for part in (asked[0], asked[2], "a/b/c"))


def test_a_failed_diagnosis_gives_no_answer(here: Hdcal, runs: Path):
    for command in ("margin", "predict"):
        result = here(command, runs / "failed", *AT)
        assert result.returncode == 1 and result.stdout == ""
        assert "must not be used" in result.stderr


# --- certificate ---

ISSUED = date(2026, 11, 22)


def test_the_longest_certificate_is_one_page(tmp_path: Path):
    """Every source, far outside what was tested."""
    gears = batch(6, 400)
    gear = replace(gears.case.gear, name="a gear with a name of many words " * 6)
    named = replace(gears, case=replace(gears.case, gear=gear))
    sizes = dict.fromkeys(("wall_thickness_mm", "radius_mm", "length_mm"), 0.02)
    asked = {"tolerances": sizes, "temperature": [-20.0, 20.0, 80.0]}
    models = [(0.6, named), (0.4, stiffer(named, 1.05))]
    found = package.margin(models, 0.8, limit_force=190.0, direction="down", **asked)
    page = tmp_path / "certificate.html"
    page.write_text(found.certificate(ISSUED), "utf-8")
    looked = look(page, tmp_path)
    assert not looked.requests and not looked.complaints
    assert looked.frames["paper"]["width"] <= PAPER, looked.frames["paper"]["past"]
    assert print_pages(page, tmp_path) == 1


def test_a_certificate_states_result_data_and_method():
    posterior = single(size=400)
    found = package.margin(posterior, 0.4, limit_force=90.0, seed=3)
    page = found.certificate(ISSUED).partition("<body")[2]
    words = " ".join(re.sub(r"<[^>]+>", " ", page).split())
    for part in (
        posterior.case.gear.name,
        posterior.case.data_sha256,
        f"k = {found.coverage_factor:.2f}",
        f"hdcal {found.versions['hdcal']}, seed 3",
        found.decision.statement,
        "2026-11-22",
    ):
        assert part in words, part
    failed = replace(posterior, checks=(Check("r_hat", "failed", "is 1.5"),))
    with pytest.raises(NotUsable):
        found.model_copy(update={"posterior": failed}).certificate(ISSUED)
