"""Open a blind check: everything is verified before a label is seen by anyone."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hdcal.blind.answer import Opening, ScoredAnswers
from hdcal.blind.answer_files import AnswerFiles, answering_names, frozen_names
from hdcal.blind.canonical import Broken, digest_agrees, with_digest
from hdcal.blind.closures import closures
from hdcal.blind.files import (
    GET_AGAIN,
    LARGEST_ANSWER,
    LARGEST_KEY,
    read_bytes,
    read_json,
    refusal,
)
from hdcal.blind.scoring.scores import JUDGED, Scores, score
from hdcal.blind.seal import Sealed, check_labels, unseal
from hdcal.blind.sealed_set import RESTORE_OPENED, RESULT, SEALED, BlindSet, read_set
from hdcal.blind.summary import scores_report
from hdcal.errors import said_if_interrupted
from hdcal.report.plain import as_json, printable
from hdcal.report.saving.reserve import reserve_folder, write_whole
from hdcal.report.saving.target import TargetFolder
from hdcal.report.write import Report, write_report

OPENED_SCHEMA = "hdcal.blind-opened/1"


@dataclass(frozen=True)
class OpenedSet:
    """The result of an opened set.

    Attributes:
        folder: where the result is.
        opening: whose answers were scored.
        report: of their scores.
        before: when it was opened first; None where that is now.
    """

    folder: Path
    opening: Opening
    report: Report[Scores]
    before: str | None


def open_set(folder: Path | str, key: Path, by: Sequence[str] = ()) -> OpenedSet:
    """Verify set and answers, decrypt the labels, score, and write the result.

    Args:
        folder: the set.
        key: file with its key.
        by: whose answers to score; all that are frozen when empty.

    Raises:
        InputError: answers are not frozen, or anything is not what was promised.
    """
    found = read_set(folder)
    with reserve_folder(found.folder / RESULT, force=True) as target:
        return _open(found, key, by, target)


def _open(
    found: BlindSet, key: Path, by: Sequence[str], target: TargetFolder
) -> OpenedSet:
    # Whoever is not scored today was blind all the same, and is recorded as such.
    ended = answering_names(found, ".json")
    everyone = sorted(ended.union(by)) if by else frozen_names(found)
    frozen = {name: AnswerFiles(found, name).frozen() for name in everyone}
    hashes = {name: data["sha256"] for name, (data, _) in frozen.items()}
    before = _read_opened(found)
    first = hashes if before is None else before["answers"]
    secret = _unsealed(found, key)
    chosen = list(by or everyone)
    answers = {name: frozen[name][1] for name in chosen}
    opening = Opening(
        set_commitment=found.manifest.commitment,
        mix=secret.mix,
        not_bound=found.manifest.not_bound,
        answers={
            name: ScoredAnswers(
                hashes[name],
                frozen[name][0]["blind"] and first.get(name) == hashes[name],
            )
            for name in chosen
        },
    )
    judged = JUDGED if JUDGED in answers else chosen[0]
    scores = score(
        secret.labels,
        answers,
        dict(frozen[chosen[0]][0]["families"]),
        closures(found, secret.labels, answers[judged]),
        {label.case for label in secret.labels if label.mix == "prior"} or None,
        judged,
    )
    others = {"opening.json": opening, "labels.json": secret.plain()}
    report = scores_report(scores, secret.labels, answers, others)
    if before is None:
        # Before any label reaches the disk: what is answered later is not blind.
        write_whole(found.opened, as_json(with_digest(_record(found, hashes))))
    with said_if_interrupted(f"{found.opened} is written"):
        write_report(report, target)
    when = None if before is None else printable(before["time"][:40])
    return OpenedSet(found.folder / RESULT, opening, report, when)


def _unsealed(found: BlindSet, key: Path) -> Sealed:
    remedy = "Name the key file that was written with this set"
    try:
        own = read_bytes(key, remedy, LARGEST_KEY).strip()
        secret = unseal(found.sealed(), own)
    except Broken as error:
        raise refusal(key, str(error), remedy) from None
    try:
        check_labels(found.manifest, secret)
    except Broken as error:
        raise refusal(found.folder / SEALED, str(error), GET_AGAIN) from None
    return secret


def _read_opened(found: BlindSet) -> dict[str, Any] | None:
    """Return the record of the first opening, None before it."""
    path, remedy = found.opened, RESTORE_OPENED
    if not found.was_opened:
        return None
    data = read_json(path, OPENED_SCHEMA, remedy, LARGEST_ANSWER)
    whole = isinstance(data.get("answers"), dict) and isinstance(data.get("time"), str)
    if not digest_agrees(data) or not whole:
        raise refusal(path, "was edited: its hash does not fit", remedy)
    if data.get("set_commitment") != found.manifest.commitment:
        raise refusal(path, "tells of another set", remedy)
    return data


def _record(found: BlindSet, hashes: dict[str, str]) -> dict[str, Any]:
    return {
        "schema": OPENED_SCHEMA,
        "set_commitment": found.manifest.commitment,
        "answers": hashes,
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
