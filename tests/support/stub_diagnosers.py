"""Diagnosers of the blind check for tests, importable by other processes."""

import os
from pathlib import Path

from benchmarks.blind.label import NONE, UNKNOWN, Answer


def answer(case: str, chances: dict[str, float], library=(), **more) -> Answer:
    """Return an answer that follows its probabilities."""
    top = max(chances, key=lambda name: chances[name])
    effects = {n: p for n, p in chances.items() if n not in (NONE, UNKNOWN)}
    given = {
        "verdict": top if top in (NONE, UNKNOWN) else "named",
        "effect": None if top in (NONE, UNKNOWN) else top,
        "second_effect": None,
        "set": (top,),
        "probabilities": chances,
        "inclusion": {**dict.fromkeys(library, 0.0), **effects},
        "detected": top != NONE,
    }
    return Answer(case=case, **{**given, **more})


def noted(case, library) -> Answer:
    """Name screw errors, note each case, and fail at the one that is set to fail."""
    with Path(os.environ["NOTED_CASES"]).open("a") as file:
        file.write(f"{case.name} {len(library)}\n")
    if case.name == os.environ.get("FAILING_CASE"):
        raise ValueError("planted")
    return answer(case.name, {"screw_error": 0.7, NONE: 0.3}, library)
