"""Answers to a blind check on disk: one file each, then all of them frozen."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hdcal.blind.canonical import digest_agrees, with_digest
from hdcal.blind.files import LARGEST, LARGEST_ANSWER, read_json, refusal
from hdcal.blind.label import CaseAnswer
from hdcal.blind.manifest import Entry, is_name
from hdcal.blind.sealed_set import BlindSet
from hdcal.data.typed_json import Name, typed
from hdcal.errors import InputError
from hdcal.report.plain import as_json, as_plain
from hdcal.report.saving.leftovers import sweep
from hdcal.report.saving.reserve import reserve_file, write_whole
from hdcal.report.saving.target import TargetFile

ANSWER_SCHEMA, ANSWERS_SCHEMA = "hdcal.blind-answer/1", "hdcal.blind-answers/1"
_PREFIX = "answers-"
# Of frozen answers, in bytes; those of hdcal take a quarter of it.
_PER_CASE = 1 << 16
_ASK_AGAIN = "Delete it and run 'hdcal blind answer' again"


class AnswerFiles:
    """The answers of one diagnoser to one set.

    Args:
        found: the set.
        by: name of the diagnoser.

    Raises:
        InputError: the name could be no file's.
    """

    def __init__(self, found: BlindSet, by: str):
        if not is_name(by):
            words = f"'{by}' cannot be part of a file's name"
            raise refusal("by", words, "Use letters, digits, - and _")
        self.set, self.by = found, by
        self.folder = found.folder / f"{_PREFIX}{by}"
        self.file = found.folder / f"{_PREFIX}{by}.json"

    def path(self, case: str) -> Path:
        """Return the file of one answer."""
        return self.folder / f"{case}.json"

    def reserve(self) -> TargetFile:
        """Reserve the file of the frozen answers: nobody else answers meanwhile.

        Raises:
            InputError: they are frozen already, or somebody else is answering.
        """
        if self.file.exists():
            words = "exists already: these answers are frozen"
            remedy = f"Move it and {self.folder.name} away to answer anew"
            raise refusal(self.file, words, remedy)
        target = reserve_file(self.file)
        if self.folder.is_dir():
            sweep(self.folder, target.lock)
        return target

    def kept(self, fingerprint: Mapping[str, Any]) -> set[str]:
        """Return which cases are answered already.

        Args:
            fingerprint: by which all answers have to be made.

        Raises:
            InputError: one is no answer to this set, or was made by other versions.
        """
        cases = {entry.case: entry for entry in self.set.manifest.cases}
        names = {path.stem for path in self.folder.glob("*.json")}
        for name in sorted(names - cases.keys()):
            words = "answers no case of this set"
            raise refusal(self.path(name), words, "Take it out of the folder")
        for name in sorted(names):
            self._check_version(name, self.read(cases[name]), fingerprint)
        return names

    def read(self, entry: Entry) -> dict[str, Any]:
        """Return one answer with what it was made by.

        Raises:
            InputError: it is missing, broken, edited, or belongs to other data.
        """
        path = self.path(entry.case)
        data = read_json(path, ANSWER_SCHEMA, _ASK_AGAIN, LARGEST_ANSWER)
        if not digest_agrees(data):
            raise refusal(path, "was edited: its hash does not fit", _ASK_AGAIN)
        bound = data.get("set_commitment"), data.get("csv_sha256"), data.get("by")
        if bound != (self.set.manifest.commitment, entry.sha256, self.by):
            raise refusal(path, "answers another set, case or name", _ASK_AGAIN)
        read_answer(data.get("answer"), entry.case, path)
        return data

    def write(
        self, entry: Entry, answer: CaseAnswer, fingerprint: Mapping[str, Any]
    ) -> None:
        """Write one answer, whole or not at all."""
        data = {
            "schema": ANSWER_SCHEMA,
            "by": self.by,
            "set_commitment": self.set.manifest.commitment,
            "csv_sha256": entry.sha256,
            "fingerprint": fingerprint,
            "answer": as_plain(answer),
        }
        self.folder.mkdir(exist_ok=True)
        write_whole(self.path(entry.case), as_json(with_digest(data)))

    def freeze(
        self,
        target: TargetFile,
        fingerprint: Mapping[str, Any],
        families: Mapping[str, str],
        library: str,
    ) -> dict[str, Any]:
        """Write all answers into one file, and return what it holds.

        Args:
            target: from `reserve`.
            fingerprint: by which all answers were made.
            families: of the effects.
            library: as it was asked for.

        Raises:
            InputError: an answer is missing or does not fit the others.
        """
        self.kept(fingerprint)
        answers = [self.read(entry)["answer"] for entry in self.set.manifest.cases]
        data = with_digest(
            {
                "schema": ANSWERS_SCHEMA,
                "by": self.by,
                "set_commitment": self.set.manifest.commitment,
                "library": library,
                "fingerprint": dict(fingerprint),
                "families": dict(families),
                "blind": not self.set.was_opened,
                "answers": answers,
            }
        )
        target.write(as_json(data).encode())
        return data

    def frozen(self) -> tuple[dict[str, Any], list[CaseAnswer]]:
        """Return the frozen answers, as data and as answers in the set's order.

        Raises:
            InputError: they are missing, edited, incomplete, or of another set.
        """
        if not self.file.exists():
            words = f"is missing: the answers of '{self.by}' are not frozen"
            remedy = "Let 'hdcal blind answer' come to its end first"
            raise refusal(self.file, words, remedy)
        remedy = "Restore the file, or move it and its folder away and answer again"
        cases = self.set.manifest.cases
        most = min(LARGEST_ANSWER + _PER_CASE * len(cases), LARGEST)
        data = read_json(self.file, ANSWERS_SCHEMA, remedy, most)
        if not digest_agrees(data):
            words = "was edited: its hash does not fit"
            raise refusal(self.file, words, remedy)
        if data.get("set_commitment") != self.set.manifest.commitment:
            words = "answers another set: the commitments differ"
            raise refusal(self.file, words, "Answer this set")
        listed = data.get("answers")
        if not isinstance(listed, list) or len(listed) != len(cases):
            words = "does not answer every case once"
            raise refusal(self.file, words, remedy)
        pairs = list(zip(listed, cases, strict=True))
        found = [read_answer(one, entry.case, self.file) for one, entry in pairs]
        try:
            typed(dict[Name, Name], data.get("families"))
            kinds = {"blind": bool, "fingerprint": dict}
            sound = all(isinstance(data.get(key), kind) for key, kind in kinds.items())
        except ValueError:
            sound = False
        if data.get("by") != self.by or not sound:
            words = "is not what 'hdcal blind answer' writes"
            raise refusal(self.file, words, remedy)
        if self.folder.is_dir():
            self._check_same(data)
        return data, found

    def _check_same(self, data: dict[str, Any]) -> None:
        """Hold the single answers against the frozen ones."""
        self.kept(data["fingerprint"])
        for entry, answer in zip(self.set.manifest.cases, data["answers"], strict=True):
            if self.read(entry)["answer"] != answer:
                words = "is not the answer that was frozen"
                remedy = f"One of it and {self.file.name} was edited: restore both"
                raise refusal(self.path(entry.case), words, remedy)

    def _check_version(
        self, case: str, data: dict[str, Any], wanted: Mapping[str, Any]
    ) -> None:
        made = data.get("fingerprint")
        made = made if isinstance(made, dict) else {}
        differ = [
            k for k in sorted(wanted.keys() | made) if wanted.get(k) != made.get(k)
        ]
        if differ:
            words = f"mixed versions: it was made with another {', '.join(differ)}"
            remedy = f"Go on with the version that made it, or move {self.folder} away"
            raise refusal(self.path(case), words, remedy + " to answer all cases anew")


def read_answer(data: Any, case: str, path: Path) -> CaseAnswer:
    """Return the answer of plain data from a file.

    Raises:
        InputError: it is none, or one to another case.
    """
    try:
        answer = CaseAnswer.from_plain(data)
        if answer.case != case:
            raise ValueError
    except ValueError:
        words = f"holds no answer to the case '{case}'"
        raise refusal(path, words, _ASK_AGAIN) from None
    return answer


def answering_names(found: BlindSet, ending: str = "") -> set[str]:
    """Return who has begun to answer a set, or with `.json` who has come to the end.

    Raises:
        InputError: a file is called like answers, but after nobody.
    """
    names = set()
    for path in sorted(found.folder.glob(f"{_PREFIX}*{ending}")):
        if not path.is_dir() and path.suffix != ".json":
            continue
        name = path.name.removesuffix(".json").removeprefix(_PREFIX)
        if not is_name(name):
            words, remedy = "is no file of this set", "Take it out of the folder"
            raise refusal(path, words, remedy)
        names.add(name)
    return names


def frozen_names(found: BlindSet) -> list[str]:
    """Return who has answered a set.

    Raises:
        InputError: somebody has begun and not come to the end, or nobody has begun.
    """
    names = answering_names(found)
    if not names:
        words = "holds no frozen answers"
        raise refusal(found.folder, words, "Run 'hdcal blind answer' first")
    findings = []
    for name in sorted(names):
        if not AnswerFiles(found, name).file.exists():
            words = f"the answers of '{name}' are not frozen"
            remedy = "Let 'hdcal blind answer' come to its end, or move them away"
            findings += refusal(AnswerFiles(found, name).folder, words, remedy).findings
    if findings:
        raise InputError(findings)
    return sorted(names)
