"""Diagnosers of the blind check for tests, importable by other processes."""

import os
from pathlib import Path

from benchmarks.blind.label import NONE, OUTSIDE, Answer, Cause


def answer(case: str, chances: dict[str, float], library=(), **more) -> Answer:
    """Return an answer that follows its probabilities of explanations."""
    top = max(chances, key=lambda name: chances[name])
    effects = {n: p for n, p in chances.items() if n not in (NONE, OUTSIDE)}
    given = {
        "gap": 1.0 - chances.get(NONE, 0.0),
        "explanations": chances,
        "set": (top,),
        "inclusion": {**dict.fromkeys(library, 0.0), **effects},
        "classes": tuple(Cause((name,), p) for name, p in effects.items()),
        "outside": Cause((OUTSIDE,), chances.get(OUTSIDE, 0.0)),
    }
    return Answer(case=case, **{**given, **more})


def noted(case, library) -> Answer:
    """Say screw errors, note each case, and fail at the one that is set to fail."""
    with Path(os.environ["NOTED_CASES"]).open("a") as file:
        file.write(f"{case.name} {len(library)}\n")
    if case.name == os.environ.get("FAILING_CASE"):
        raise ValueError("planted")
    return answer(case.name, {"screw_error": 0.97, NONE: 0.03}, library)
