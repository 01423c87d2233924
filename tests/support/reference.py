"""Numbers of a reference, in a JSON file beside the test that compares with them.

They guard what other tests hold within bounds only. A change of method renews them, on
purpose: `HDCAL_RENEW=1 python -m pytest tests/ROOM/test_ROOM_reference.py`.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest


def assert_reference(file: str, name: str, found: Mapping[str, Any], **within: float):
    """Compare numbers, or lists of them, with those beside a test file, by name."""
    path = Path(file).with_suffix(".json")
    known = json.loads(path.read_text("utf-8")) if path.exists() else {}
    if os.environ.get("HDCAL_RENEW") == "1":
        known[name] = {key: _rounded(value) for key, value in sorted(found.items())}
        # One line a key.
        lines = json.dumps(known, sort_keys=True).replace('], "', '],\n "')
        path.write_text(lines.replace('}, "', '},\n"') + "\n", "utf-8")
    assert found.keys() == known[name].keys()
    for key, value in found.items():
        assert value == pytest.approx(known[name][key], **within), key


def _rounded(value: Any) -> Any:
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    return float(f"{value:.7g}")
