"""The file with the pass phrase that signing keys are made of."""

import stat
from pathlib import Path

from hil.errors import InputError
from hil.mavlink.signing import key_of

MAX_BYTES = 4096


def read_key(path: Path) -> bytes:
    """The key from a file that nobody but its owner may read. Raises InputError."""
    try:
        mode = path.stat().st_mode
        raw = path.read_bytes() if stat.S_ISREG(mode) else b""
        phrase = raw[:MAX_BYTES].decode("utf-8").strip()
    except OSError as error:
        why = error.strerror
        raise InputError(f"--signing-key {path}: cannot be read: {why}; check the path") from None
    except UnicodeDecodeError:
        raise InputError(f"--signing-key {path}: is no text; it holds a pass phrase") from None
    if not stat.S_ISREG(mode):
        raise InputError(f"--signing-key {path}: is not a file; it holds a pass phrase")
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        shown = f"{stat.S_IMODE(mode):04o}"
        raise InputError(f"--signing-key {path}: mode {shown}, others may use it; chmod 600 it")
    if len(raw) > MAX_BYTES:
        raise InputError(f"--signing-key {path}: {len(raw)} bytes; the limit is {MAX_BYTES}")
    if not phrase:
        raise InputError(f"--signing-key {path}: is empty; it holds a pass phrase")
    return key_of(phrase)
