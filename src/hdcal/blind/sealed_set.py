"""A set of the blind check on disk: written whole, and never believed unread."""

import json
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hdcal.blind.label import Label
from hdcal.blind.seal import (
    SET_SCHEMA,
    Broken,
    Entry,
    Manifest,
    Sealed,
    check_names,
    commit,
    digest,
    drawn_salt,
    library_of,
    new_key,
    new_salt,
    seal,
)
from hdcal.data.regular_file import why_not_readable
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import versions
from hdcal.report.plain import as_json, printable
from hdcal.report.saving.disk import write_file
from hdcal.report.saving.reserve import reserve_file, reserve_folder
from hdcal.report.saving.target import KeptBeside

# Of one file of a set.
_LARGEST = 1 << 30
SET, SEALED, GEAR, CASES = "set.json", "sealed.bin", "gear.toml", "cases"
GET_AGAIN = "Get the set again from whoever made it; this copy proves nothing"


def refusal(file: Path | str, problem: str, remedy: str) -> InputError:
    """Return what is wrong with one file as an error."""
    return InputError([Finding(str(file), printable(problem), remedy)])


@dataclass(frozen=True)
class BlindSet:
    """A set whose public part is what its commitment promises.

    Attributes:
        folder: where it is.
        manifest: what is public about it.
    """

    folder: Path
    manifest: Manifest

    @property
    def opened(self) -> Path:
        """File that tells when it was opened, and for which answers."""
        return self.folder / "opened.json"

    def csv(self, entry: Entry) -> bytes:
        """Return the data of a case.

        Raises:
            InputError: they are missing or were changed.
        """
        path = self.folder / CASES / f"{entry.case}.csv"
        return _checked(path, entry.sha256, "was changed since the set was sealed")

    def gear(self) -> bytes:
        """Return the gear file.

        Raises:
            InputError: it is missing or was changed.
        """
        words = "was changed since the set was sealed"
        return _checked(self.folder / GEAR, self.manifest.gear_sha256, words)

    def sealed(self) -> bytes:
        """Return the encrypted labels.

        Raises:
            InputError: they are missing or were changed.
        """
        words = "was changed or is incomplete"
        return _checked(self.folder / SEALED, self.manifest.sealed_sha256, words)


def read_set(folder: Path | str) -> BlindSet:
    """Read a set and verify everything that can be without the key.

    Raises:
        InputError: holds everything that is missing, too much or changed.
    """
    folder = Path(folder)
    if not (folder / SET).is_file():
        words = f"is no blind check: it holds no {SET}"
        raise refusal(folder, words, "Name a folder that 'hdcal blind make' has made")
    data = read_json(folder / SET, SET_SCHEMA, GET_AGAIN)
    try:
        found = BlindSet(folder, Manifest.from_plain(data))
    except Broken as error:
        raise refusal(folder / SET, str(error), GET_AGAIN) from None
    findings: list[Finding] = []
    reads: list[Callable[[], bytes]] = [found.gear, found.sealed]
    reads += [lambda entry=entry: found.csv(entry) for entry in found.manifest.cases]
    for read in reads:
        try:
            read()
        except InputError as error:
            findings += error.findings
    known = {f"{entry.case}.csv" for entry in found.manifest.cases}
    for path in sorted((folder / CASES).glob("*.csv")):
        if path.name not in known:
            words, remedy = "is no case of this set", "Take it out of the folder"
            findings.append(Finding(str(path), words, remedy))
    if findings:
        raise InputError(findings)
    return found


def read_json(path: Path, schema: str, remedy: str) -> dict[str, Any]:
    """Read an object of one schema.

    Args:
        path: the file.
        schema: what its `schema` has to be.
        remedy: what to do where it is not.

    Raises:
        InputError: it is missing, no JSON, or of another schema.
    """

    def refuse(_: str) -> float:
        raise ValueError

    text = _bytes(path, remedy)
    try:
        data = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError):
        raise refusal(path, "is no JSON, or only half of it", remedy) from None
    if not isinstance(data, dict) or data.get("schema") != schema:
        raise refusal(path, f"is not of the schema {schema}", remedy)
    return data


def write_set(
    target: Path | str,
    drawn: Iterable[tuple[str | bytes, Label]],
    gear: str | bytes,
    key: Path,
    *,
    mix: str = "",
    seed: int | None = None,
    force: bool = False,
) -> Manifest:
    """Write a set and, beside it, its key.

    Args:
        target: the folder to make.
        drawn: table and label of each case; first asked when both may be written.
        gear: text of the gear file of all of them.
        key: the file to make, readable to its owner only; no other is ever replaced.
        mix: name of the mix, sealed with the labels.
        seed: of the mix, sealed too; salts follow from it. None for a measurement.
        force: whether an older set without answers may be replaced.

    Raises:
        InputError: the target or the key exists, or the key would lie in the set.
        NotWritable: the disk refused.
    """
    _check_key(key, target)
    secret = new_key()
    with (
        reserve_folder(target, force=force, unstamped=_plain_set) as folder,
        reserve_file(key) as file,
        _removed_on_failure(key, secret),
        folder.filled() as into,
    ):
        manifest = _fill(into, drawn, _encoded(gear), secret, mix, seed)
        # No set is ever seen without its key.
        file.write(secret + b"\n", 0o600)
    return manifest


def _fill(
    into: Path,
    drawn: Iterable[tuple[str | bytes, Label]],
    gear: bytes,
    secret: bytes,
    mix: str,
    seed: int | None,
) -> Manifest:
    labels, salts, entries = [], [], []
    (into / CASES).mkdir()
    for table, label in drawn:
        check_names([label.case])
        data = _encoded(table)
        salt = new_salt() if seed is None else drawn_salt(seed, label.case)
        write_file(into / CASES / f"{label.case}.csv", data)
        promise = commit(label, salt, digest(data))
        entries.append(Entry(label.case, digest(data), promise, library_of(label)))
        labels.append(label)
        salts.append(salt)
    check_names([entry.case for entry in entries])
    token = seal(Sealed(mix, seed or 0, tuple(labels), tuple(salts)), secret)
    write_file(into / SEALED, token)
    write_file(into / GEAR, gear)
    manifest = Manifest(tuple(entries), digest(gear), digest(token), versions())
    write_file(into / SET, as_json(manifest.plain()).encode())
    return manifest


def _check_key(key: Path, target: Path | str) -> None:
    if key.resolve().is_relative_to(Path(os.path.realpath(target))):
        words = "would lie inside the set, which it opens"
        raise refusal(key, words, "Name a place outside with `key`")
    if os.path.lexists(key):
        words = "exists already, and may be the only key to another set"
        raise refusal(key, words, "Name another file with `key`, or move it away")


def _plain_set(folder: Path) -> list[str]:
    """Return the files of an intact set without a stamp; of any other none."""
    try:
        cases = read_set(folder).manifest.cases
    except InputError:
        return []
    return [SET, SEALED, GEAR, *(f"{CASES}/{entry.case}.csv" for entry in cases)]


@contextmanager
def _removed_on_failure(path: Path, secret: bytes) -> Iterator[None]:
    """Remove a key where there is no set that it opens."""
    try:
        yield
    except KeptBeside:
        raise
    except BaseException:
        if path.is_file() and path.read_bytes().strip() == secret:
            path.unlink()
        raise


def _encoded(text: str | bytes) -> bytes:
    return text.encode() if isinstance(text, str) else text


def _bytes(path: Path, remedy: str) -> bytes:
    if (why := why_not_readable(path, _LARGEST)) is not None:
        raise refusal(path, why[0], remedy)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise refusal(path, "is missing", remedy) from None
    except OSError as error:
        words = f"cannot be read ({error.strerror or error})"
        raise refusal(path, words, remedy) from None


def _checked(path: Path, sha256: str, problem: str) -> bytes:
    data = _bytes(path, GET_AGAIN)
    if digest(data) != sha256:
        raise refusal(path, problem, GET_AGAIN)
    return data
