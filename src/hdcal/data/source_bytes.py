"""The bytes of a text file, checked while they stream in."""

import codecs
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from hdcal.errors import Finding, InputError

CHUNK = 1 << 18
LONGEST_LINE = 1 << 20
LARGEST_FILE = 1 << 32

_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@dataclass(frozen=True)
class Text:
    """A file's text as UTF-8 with plain newlines.

    Attributes:
        utf8: the text; no byte-order mark, lines end with one newline.
        sha256: hash of the file's own bytes.
    """

    utf8: bytes
    sha256: str


def read_text(path: Path, file: str) -> Text:
    """Read a text file, refusing what is no text before it fills the memory.

    Args:
        path: where it is.
        file: how the user named it.

    Raises:
        InputError: missing, unreadable, a folder, binary, or a line over 1 MiB.
    """
    if path.is_dir():
        _refuse(file, "is a folder", "Name the file inside it")
    try:
        raw, sha256 = _stream(path, file)
    except FileNotFoundError:
        _refuse(file, "does not exist", "Check the name and the folder")
    except PermissionError:
        _refuse(file, "may not be read", "Give yourself the permission to read it")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        _refuse(file, f"cannot be read ({reason})", "Check the name and the disk")
    utf8 = _as_utf8(raw, file)
    if b"\r" in utf8:
        utf8 = utf8.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return Text(utf8, sha256)


def _stream(path: Path, file: str) -> tuple[bytes, str]:
    """Bytes and hash; gives up at the first sign that this is not a table."""
    digest, kept = hashlib.sha256(), []
    line, row, size, wide = 0, 1, 0, False
    with open(path, "rb") as stream:
        while chunk := stream.read(CHUNK):
            if not kept:
                wide = chunk.startswith(_WIDE_MARKS)
            if chunk.startswith(b"PK\x03\x04") and not kept:
                _refuse(file, "is a workbook or an archive", "Save it as CSV")
            if not wide and b"\0" in chunk:
                _refuse(file, "is a binary file", "Save it as UTF-8 text")
            last = max(chunk.rfind(b"\n"), chunk.rfind(b"\r"))
            line = line + len(chunk) if last < 0 else len(chunk) - last - 1
            if line > LONGEST_LINE:
                row += sum(part.count(b"\n") for part in kept)
                words = "has a line of more than 1 MiB, so it is no table of readings"
                _refuse(file, words, "Write one row of readings per line", row)
            size += len(chunk)
            if size > LARGEST_FILE:
                _refuse(file, "is larger than 4 GiB", "Split or thin out the readings")
            digest.update(chunk)
            kept.append(chunk)
    return b"".join(kept), digest.hexdigest()


def _as_utf8(raw: bytes, file: str) -> bytes:
    if raw.startswith(_WIDE_MARKS):
        try:
            utf8 = raw.decode("utf-16").encode()
        except UnicodeError:
            _refuse(file, "is broken UTF-16 text", "Save it as UTF-8 text")
        if b"\0" in utf8:
            _refuse(file, "is a binary file", "Save it as UTF-8 text")
        return utf8
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError as error:
        row = raw.count(b"\n", 0, error.start) + 1
        _refuse(file, "is not UTF-8 text", "Save it as UTF-8 text", row)
    return raw.removeprefix(codecs.BOM_UTF8)


def _refuse(file: str, problem: str, remedy: str, row: int | None = None) -> NoReturn:
    raise InputError([Finding(file, problem, remedy, row)])
