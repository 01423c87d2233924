"""Where nobody looks, a long task says how far it has come, and a short one nothing."""

import pytest

from hdcal.cli import progress


def said(capsys, seconds: float, monkeypatch: pytest.MonkeyPatch) -> str:
    clock = iter(range(1_000))
    monkeypatch.setattr(progress.time, "monotonic", lambda: seconds * next(clock))
    with progress.progress_bar("sampling") as tell:
        for done in range(0, 101, 5):
            tell(done, 100)
    return capsys.readouterr().err


def test_a_long_task_tells_its_quarters_once(capsys, monkeypatch):
    lines = said(capsys, 10.0, monkeypatch).splitlines()
    assert lines == [f"hdcal: sampling, {share} % done" for share in (25, 50, 75)]


def test_a_short_one_is_silent(capsys, monkeypatch):
    assert said(capsys, 0.1, monkeypatch) == ""
