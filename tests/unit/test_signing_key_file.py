"""The key file: whose business it is, and what is wrong with it."""

from pathlib import Path

import pytest

from hil.errors import InputError
from hil.mavlink import key_of, read_key


def key_file(folder: Path, content: bytes, mode: int = 0o600) -> Path:
    path = folder / "key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def test_the_pass_phrase_without_white_space_around_it(tmp_path: Path) -> None:
    assert read_key(key_file(tmp_path, b"  a pass phrase \n")) == key_of("a pass phrase")
    assert read_key(key_file(tmp_path, b"x", 0o400)) == key_of("x")


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        (b"x", 0o640, "mode 0640, others may use it; chmod 600 it"),
        (b"x", 0o604, "mode 0604"),
        (b" \n", 0o600, "is empty"),
        (b"\xff\xfe", 0o600, "is no text"),
        (b"x" * 5000, 0o600, "the limit is 4096"),
    ],
)
def test_bad_files(content: bytes, mode: int, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        read_key(key_file(tmp_path, content, mode))


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_key(tmp_path / "missing")
    with pytest.raises(InputError, match="is not a file"):
        read_key(tmp_path)
