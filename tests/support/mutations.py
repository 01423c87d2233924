"""Seeded damage to files: bytes flipped, JSON whose parts are something else."""

import json
import random
from typing import Any

ODD: list[Any] = [
    *(None, True, -1, 0.5, 1e308, 10**400, "", "x", "\ud800", "\x1b[2J", "../x", "$x"),
    *([], {}, [[]], [0.1, 0.2, 0.3], {"a": 1}, {"hysteresis": 1.0}, "named", "0" * 64),
]
# Of which no JSON is made by a writer of it.
RAW = [
    *("1e999", "NaN", "-Infinity", "9" * 6000, "[" * 900 + "]" * 900, "[" * 100_000),
    *('{"a":1,"a":2}', "tru", "'x'", '"\\ud800"'),
]
# What no rig has, of the type that it should be.
_ODD_NUMBERS = [float("nan"), float("inf"), 0, -1, -0.5, 1e-300, 1e300, -1e30, 10**40]
_MARK = "@@raw@@"


def damaged_bytes(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with one damage."""
    place = rng.randrange(len(data) + 1)
    end = place + rng.choice([1, 10, 1000])
    return rng.choice(
        [
            data[:place],
            data[:place] + data[end:],
            data[:end] + data[place:],
            data[:place] + rng.randbytes(5) + data[place:],
            b"\xef\xbb\xbf" + data,
            b"[" + data,
            data + b"}",
            data + data,
            bytes(len(data)),
            data.decode("utf-8", "replace").encode("utf-16"),
        ]
    )


def damaged_data(data: Any, rng: random.Random) -> Any:
    """Return plain data with one part exchanged, removed, added or doubled."""
    found = json.loads(json.dumps(data))
    parent, key = rng.choice(list(_places(found)))
    value = rng.choice(ODD)
    match rng.randrange(5):
        case 0:
            del parent[key]
        case 1:
            parent[key] = [parent[key]]
        case 2 if isinstance(parent, list):
            parent.append(parent[key])
        case 3 if isinstance(parent, dict):
            parent["more"] = value
        case _:
            parent[key] = value
    return found


def damaged_text(data: Any, rng: random.Random) -> str:
    """Return the JSON of plain data with one part that no writer makes."""
    found = json.loads(json.dumps(data))
    parent, key = rng.choice(list(_places(found)))
    parent[key] = _MARK
    return json.dumps(found).replace(json.dumps(_MARK), rng.choice(RAW))


def damaged_number(data: Any, rng: random.Random) -> str:
    """Return the JSON of plain data in which one number is another."""
    found = json.loads(json.dumps(data))
    numbers = [
        (parent, key)
        for parent, key in _places(found)
        if isinstance(parent[key], int | float) and not isinstance(parent[key], bool)
    ]
    parent, key = rng.choice(numbers)
    parent[key] = rng.choice(_ODD_NUMBERS)
    return json.dumps(found)


def _places(data: Any) -> list[tuple[Any, Any]]:
    """Return where something stands, the outer places as often as the inner ones."""
    levels, here = [], [data]
    while here:
        keys = [
            (one, key)
            for one in here
            if isinstance(one, dict | list)
            for key in (one if isinstance(one, dict) else range(len(one)))
        ]
        here = [one[key] for one, key in keys]
        levels.append(keys)
    most = max(map(len, levels))
    return [pair for keys in levels if keys for pair in keys * (most // len(keys))]
