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
from hdcal.report.folder import check_target, whole_folder
from hdcal.report.plain import as_json, printable

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


def check_free(target: Path | str, key: Path, *, force: bool = False) -> None:
    """Refuse a set or a key that could not be written.

    Raises:
        InputError: the target or the key exists, or the key would lie in the set.
    """
    check_target(target, force=force, ours=_of_plain_set(target))
    if key.resolve().is_relative_to(Path(os.path.realpath(target))):
        words = "would lie inside the set, which it opens"
        raise refusal(key, words, "Name a place outside with `key`")
    if os.path.lexists(key):
        words = "exists already, and may be the only key to another set"
        raise refusal(key, words, "Name another file with `key`, or move it away")
    if not key.parent.is_dir():
        words = "its parent folder does not exist"
        raise refusal(key, words, "Make that first")


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
        drawn: table and label of each case.
        gear: text of the gear file of all of them.
        key: the file to make; no other is ever replaced.
        mix: name of the mix, sealed with the labels.
        seed: of the mix, sealed too; salts follow from it. None for a measurement.
        force: whether an older set without answers may be replaced.

    Raises:
        InputError: the target or the key exists, or the disk refused.
    """
    check_free(target, key, force=force)
    secret = new_key()
    labels, salts, entries = [], [], []
    ours = _of_plain_set(target)
    with _key_file(key, secret), whole_folder(target, force=force, ours=ours) as into:
        (into / CASES).mkdir()
        for table, label in drawn:
            check_names([label.case])
            data = _encoded(table)
            salt = new_salt() if seed is None else drawn_salt(seed, label.case)
            with open(into / CASES / f"{label.case}.csv", "xb") as stream:
                stream.write(data)
            promise = commit(label, salt, digest(data))
            library = library_of(label)
            entries.append(Entry(label.case, digest(data), promise, library))
            labels.append(label)
            salts.append(salt)
        check_names([entry.case for entry in entries])
        token = seal(Sealed(mix, seed or 0, tuple(labels), tuple(salts)), secret)
        (into / SEALED).write_bytes(token)
        (into / GEAR).write_bytes(_encoded(gear))
        hashes = digest(_encoded(gear)), digest(token)
        manifest = Manifest(tuple(entries), *hashes, versions())
        (into / SET).write_text(as_json(manifest.plain()), "utf-8")
    return manifest


def _of_plain_set(target: Path | str) -> Callable[[Path], bool]:
    """Return what tells the parts of an intact set; of any other nothing is ours."""
    try:
        read_set(target)
    except InputError:
        return lambda _: False
    return lambda entry: entry.name in (SET, SEALED, GEAR, CASES)


@contextmanager
def _key_file(path: Path, key: bytes) -> Iterator[None]:
    """Keep a key, readable to its owner only, if all goes well."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    try:
        descriptor = os.open(path, flags, 0o600)
    except OSError as error:
        words = f"cannot be written ({error.strerror or error})"
        raise refusal(path, words, "Name another file with `key`") from error
    try:
        with open(descriptor, "wb") as stream:
            stream.write(key + b"\n")
        yield
    except BaseException:
        path.unlink(missing_ok=True)
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
