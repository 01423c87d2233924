"""One process writes a result at a time: a lock file beside it says which."""

import errno
import fcntl
import hashlib
import os
import platform
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

# The errors of a file system that knows no locks.
_WITHOUT = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK, errno.EINVAL}


def lock_key(target: Path) -> str:
    """Return what stands for a target's name in the names of hidden files."""
    return hashlib.sha256(os.fsencode(target.name)).hexdigest()[:12]


@dataclass(frozen=True)
class Lock:
    """A held lock; the kernel gives it up when its process dies.

    Attributes:
        path: the lock file.
        key: of the target.
        descriptor: of the open lock file.
        firm: whether the file system knows locks; if not, nobody is kept out.
    """

    path: Path
    key: str
    descriptor: int
    firm: bool

    @classmethod
    def take(cls, parent: Path, key: str) -> "Lock | None":
        """Return the lock of a target, or None while another process holds it.

        Args:
            parent: folder of the target.
            key: from `lock_key`.

        Raises:
            OSError: no file can be made there.
        """
        path = parent / f".hdcal-{key}.lock"
        while True:
            flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW
            try:
                lock = cls(path, key, os.open(path, flags, 0o666), True)
            except PermissionError:
                if _is_held(path):
                    return None
                raise
            try:
                fcntl.flock(lock.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if lock.is_there():
                    return lock
            except BlockingIOError:
                os.close(lock.descriptor)
                return None
            except OSError as error:
                if error.errno in _WITHOUT:
                    return cls(path, key, lock.descriptor, False)
                os.close(lock.descriptor)
                raise
            # Whoever held it has removed the file since it was opened.
            os.close(lock.descriptor)

    @staticmethod
    def owner(parent: Path, key: str) -> str:
        """Return which process holds a lock, in words."""
        with suppress(OSError, ValueError):
            text = (parent / f".hdcal-{key}.lock").read_text("utf-8")
            process, host = text.split(" on ")
            return f"process {int(process)} on {host.strip()}"
        return "another process"

    def sign(self) -> None:
        """Write process and machine into the file.

        Raises:
            OSError: the disk refused.
        """
        os.ftruncate(self.descriptor, 0)
        os.write(self.descriptor, f"{os.getpid()} on {platform.node()}\n".encode())

    def is_there(self) -> bool:
        """Tell whether the file still has its name."""
        try:
            found = os.stat(self.path, follow_symlinks=False)
        except FileNotFoundError:
            return False
        return os.path.samestat(found, os.fstat(self.descriptor))

    def release(self) -> None:
        """Remove the file and give the lock up."""
        # Removed while held: who has opened it meanwhile sees that it is gone.
        with suppress(OSError):
            if self.is_there():
                self.path.unlink()
        os.close(self.descriptor)


def _is_held(path: Path) -> bool:
    """Tell whether a process of another user holds a lock file."""
    with suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(descriptor)
    return False
