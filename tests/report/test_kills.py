"""Killed at any call of the system, a run loses nothing and leaves no half result."""

import json
import subprocess
import sys
from pathlib import Path

import kills
import pytest
from slices import slice_of

CALLS = {
    "new folder": 50,
    "folder over folder": 80,
    "folder over one of v0.1": 80,
    "new file": 25,
    "file over file": 25,
}


def attacked(way: str, renames: bool, again: bool) -> dict:
    """Return what came of killing a write at every call."""
    script = str(Path(kills.__file__))
    command = [sys.executable, script, way, str(int(renames)), str(int(again))]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("renames", slice_of([True, False], [True]))
@pytest.mark.parametrize("way", slice_of(kills.WAYS, ["folder over one of v0.1"]))
def test_a_kill_at_any_call_leaves_the_old_or_the_new(way: str, renames: bool):
    found = attacked(way, renames, again=False)
    assert found["wrong"] == []
    assert found["kills"] == found["calls"] >= CALLS[way]


@pytest.mark.slow
@pytest.mark.parametrize("renames", [True, False])
@pytest.mark.parametrize("way", kills.WAYS)
def test_a_second_kill_while_the_first_is_mended_changes_nothing(
    way: str, renames: bool
):
    found = attacked(way, renames, again=True)
    assert found["wrong"] == []
    assert found["kills"] > 20 * found["calls"]
