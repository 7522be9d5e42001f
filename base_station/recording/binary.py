"""The Rerun program itself; ending the Python wrapper around it would leave it running."""

from pathlib import Path

import rerun_cli


def rerun(*arguments: str) -> list[str]:
    """A command line."""
    return [str(Path(rerun_cli.__file__).parent / "rerun"), *arguments]
