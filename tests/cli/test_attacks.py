"""Whatever strangers hand over: an answer or a finding, soon, and nothing else."""

import os
import random
import resource
import shutil
import sys
import time
from pathlib import Path

import pytest
from attacks import ATTACKS, make_targets, standard_input, without_a_force
from commands import Hdcal

INPUTS = int(os.environ.get("HDCAL_ATTACKS", "100000"))
CHUNKS = 20
# Of one input, and of a process that has had thousands of them.
MOST_SECONDS, MOST_KIB = 10.0, 2 * 1024**2
SLICE = 20


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of whole inputs."""
    folder = tmp_path_factory.mktemp("targets")
    make_targets(folder)
    return folder


def wrong(here: Hdcal, kind: str, seed: int, targets: Path) -> str | None:
    """Attack once; return what is wrong with the outcome, or None."""
    rng = random.Random(f"{kind} {seed}")
    arguments = ATTACKS[kind][0](rng, targets)
    before, began = set(Path().rglob("*")), time.monotonic()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdin", standard_input())
        done = here(*arguments)
    seconds, said = time.monotonic() - began, done.stdout + done.stderr
    new = set(Path().rglob("*")) - before
    reasons = {
        "an internal error": "internal error" in said or "Traceback" in said,
        f"exit code {done.returncode}": done.returncode not in (0, 1, 2),
        "no words": done.returncode != 0 and not said.strip(),
        "more words than anyone reads": len(done.stderr) > 20_000,
        f"{seconds:.1f} s": seconds > MOST_SECONDS,
        f"written: {sorted(map(str, new))[:3]}": done.returncode == 2 and bool(new),
    }
    if kind == "posterior" and done.returncode == 0:
        reasons["a band without numbers"] = without_a_force(done.stdout)
    found = [reason for reason, so in reasons.items() if so]
    return f"{kind} {seed}: {found} {arguments} {said[-500:]}" if found else None


def attacked(here: Hdcal, kind: str, seeds: range, targets: Path) -> list[str]:
    """Attack once for each seed, in an emptied folder; return what was wrong."""
    found = []
    for seed in seeds:
        for path in Path().iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        found.append(wrong(here, kind, seed, targets))
    return [one for one in found if one]


@pytest.mark.parametrize("kind", ATTACKS)
def test_a_slice_of_attacks_is_answered_or_refused(here: Hdcal, targets, kind):
    assert attacked(here, kind, range(SLICE), targets) == []


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(CHUNKS))
@pytest.mark.parametrize("kind", ATTACKS)
def test_every_attack_is_answered_or_refused(here: Hdcal, targets, kind, chunk):
    count = round(INPUTS * ATTACKS[kind][1] / CHUNKS)
    first = 1_000_000 + chunk * count
    assert attacked(here, kind, range(first, first + count), targets) == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < MOST_KIB


def test_an_internal_error_would_be_seen(here: Hdcal, targets, monkeypatch):
    import hdcal.data.reading

    def defect(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr(hdcal.data.reading, "read_case", defect)
    assert "internal error" in str(wrong(here, "gear", 0, targets))
