"""The JSON answers of `hdcal blind`: what making, answering and opening a set print."""

from dataclasses import dataclass
from typing import Any, Literal

from hdcal.blind.manifest import Entry
from hdcal.blind.scoring.scores import Scores
from hdcal.report.answer import Answer, Digest


@dataclass(frozen=True, kw_only=True)
class SetAnswer(Answer):
    """What `hdcal blind make` answers: the manifest of the set, as in set.json."""

    schema: Literal["hdcal.blind/2"] = "hdcal.blind/2"
    commitment: Digest
    cases: tuple[Entry, ...]
    gear_sha256: Digest
    sealed_sha256: Digest
    versions: dict[str, str]
    origin: Digest
    material_sha256: Digest | None


@dataclass(frozen=True, kw_only=True)
class FrozenAnswer(Answer):
    """What `hdcal blind answer` answers: all answers, frozen under one hash."""

    schema: Literal["hdcal.blind-answers/1"] = "hdcal.blind-answers/1"
    by: str
    set_commitment: Digest
    library: str
    fingerprint: dict[str, Any]
    families: dict[str, str]
    blind: bool
    answers: tuple[dict[str, Any], ...]
    sha256: Digest


@dataclass(frozen=True)
class ScoredAnswers:
    """Whose answers were scored, and whether they were frozen before the opening."""

    sha256: Digest
    blind: bool


@dataclass(frozen=True, kw_only=True)
class Opening:
    """Which set was opened and whose answers were scored, as in opening.json.

    `not_bound` is what the commitment of an older set does not promise.
    """

    schema: Literal["hdcal.blind-result/1"] = "hdcal.blind-result/1"
    set_commitment: Digest
    mix: str | None
    not_bound: tuple[str, ...] = ()
    answers: dict[str, ScoredAnswers]


@dataclass(frozen=True, kw_only=True)
class ScoresAnswer(Opening, Answer):
    """What `hdcal blind open` answers: whose answers, and their scores."""

    scores: Scores
