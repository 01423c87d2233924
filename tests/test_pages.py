"""Pages show what runs print and what the library declares.

Words of a run exactly, numbers nearly: draws differ in their last digits from machine
to machine, ends of intervals by 5 %.
"""

import json
import re
import shlex
from pathlib import Path

import pytest
from commands import Hdcal

from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.physics.effect import parameters
from hdcal.physics.registry import EFFECTS

ROOT = Path(__file__).parents[1]
NUMBER = r"-?\d+(?:\.\d+)?"
# Numbers of effective draws scatter.
DRAWS = re.compile(r"\b\d+ / \d+\b")
SHOWN = re.compile(
    r"^    (hdcal (?:[^\n\\]|\\\n)+)$|^```text\n(.*?)^```$", re.DOTALL | re.MULTILINE
)


def shown_runs(page: str) -> list[tuple[str, str]]:
    """Return each command of a page with the output that is shown of it, if any."""
    runs: list[tuple[str, str]] = []
    for found in SHOWN.finditer(page):
        if found[1]:
            runs.append((found[1].replace("\\\n", ""), ""))
        elif not found[2].startswith("hdcal: "):  # an error of another command
            runs[-1] = (runs[-1][0], found[2])
    return runs


def differences(shown: str, printed: str) -> list[str]:
    """Return what a page shows and a run did not print."""
    printed = DRAWS.sub("some", " ".join(printed.split()))
    found = []
    for piece in re.split(r"^\s*…\s*$", shown, flags=re.MULTILINE):
        words = DRAWS.sub("some", " ".join(piece.split()))
        parts = map(re.escape, re.split(NUMBER, words))
        wanted = re.findall(NUMBER, words)
        matches = re.finditer(f"({NUMBER})".join(parts), printed)
        wrong = [
            [f"{a} for {b}" for a, b in zip(wanted, m.groups(), strict=True)
             if not near(a, b)]
            for m in matches
        ]  # fmt: skip
        found += min(wrong, key=len, default=[words])
    return found


def near(shown: str, printed: str) -> bool:
    """Return whether two numbers differ by no more than draws scatter."""
    a, b = float(shown), float(printed)
    digit = 10.0 ** -len(shown.partition(".")[2])
    if a == 0.0:
        # A median of nothing, of 6,000 effective draws of a parameter with an sd of 200
        # digits: two runs differ by 4 digits.
        return abs(b) <= 20.0 * digit
    return abs(a - b) <= max(0.05 * abs(a), 5.5 * digit if digit < 1.0 else 0.0)


def test_a_difference_is_noticed():
    printed = "The force is 79.9 N (72.9\n … 87.6 N), and\n\nmore 0.9902 than that."
    same = "The force is 79.8 N (72.9 …\n87.7 N),\n  …\nmore 0.9905"
    assert not differences(same, printed)
    assert differences("The force is 99.8 N", printed) == ["99.8 for 79.9"]
    assert differences("The stiffness is 79.8 N", printed)


@pytest.mark.thorough
@pytest.mark.parametrize("page", ["tutorial", "design"])
def test_a_page_shows_what_its_commands_print(
    hdcal: Hdcal, tmp_path: Path, page: str, monkeypatch
):
    # Compiled as users' runs are: plain programs round otherwise and draw otherwise.
    for flag in ("XLA_FLAGS", "JAX_DISABLE_MOST_OPTIMIZATIONS"):
        monkeypatch.delenv(flag, raising=False)
    (tmp_path / "datasets").symlink_to(ROOT / "datasets")
    runs = shown_runs((ROOT / "docs" / "howto" / f"{page}.md").read_text("utf-8"))
    assert any(shown for _, shown in runs)
    last = max(place for place, (_, shown) in enumerate(runs) if shown)
    wrong = []
    for number, (command, shown) in enumerate(runs[: last + 1]):
        if shown or "calibrate" in command:
            command += "" if "--out" in command else f" --out {number}"
            done = hdcal(*shlex.split(command)[1:], cwd=tmp_path)
            assert done.returncode == 0, command + done.stderr
            wrong += differences(shown, done.stdout + done.stderr)
    assert not wrong


@pytest.mark.thorough
def test_the_readme_states_what_the_demo_finds(hdcal: Hdcal, tmp_path: Path):
    place = ROOT / "datasets" / "xb1-100-80"
    done = hdcal("calibrate", place, "--out", tmp_path / "result", "--json")
    found = json.loads(done.stdout)["stiffness_N_per_mm"]
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    stated = re.search(r"stiffness is (\d+) N/mm, (\d+) to (\d+) with 95 %", readme)
    assert stated is not None
    for words, end in zip(stated.groups(), ("median", "lo", "hi"), strict=True):
        assert float(words) == pytest.approx(found[end], abs=1.0)


def prior_on_page(prior: Prior) -> str:
    """Return a prior as the page of its effect states it."""
    unit = "" if prior.unit == "1" else f" {prior.unit}"
    words = {
        "half_normal": "half-normal, sd {0:g}{unit}",
        "normal": "normal, {0:g} ± {1:g}{unit}",
        "lognormal": "lognormal, median {0:g}{unit}, log sd {1:g}",
        "uniform": "uniform, {0:g} … {1:g}{unit}",
        "beta": "beta({0:g}, {1:g})",
    }[prior.family]
    return words.format(*map(float, prior.numbers), unit=unit)


def parameter_rows(effect: str) -> list[str]:
    """Return the list of the parameters of an effect."""
    priors = effect_priors()
    return [
        f"- `{name}`: {declared.meaning}; {prior_on_page(prior)}"
        for name, declared in parameters(EFFECTS[effect]).items()
        if (prior := priors[f"{effect}.{name}"])
    ]


def test_the_page_of_an_effect_lists_its_parameters_and_priors():
    folder = ROOT / "docs" / "reference" / "effects"
    assert {page.stem for page in folder.glob("*.md")} == {*EFFECTS, "index"}
    for effect in EFFECTS:
        page = (folder / f"{effect}.md").read_text("utf-8").splitlines()
        assert [line for line in page if line.startswith("- `")] == parameter_rows(
            effect
        )
