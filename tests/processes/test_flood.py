"""Strangers at every port of a run with a key: it goes on as if nobody were there."""

import subprocess
import sys

import pytest
from children import ROOT

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


def test_a_run_takes_no_notice_of_strangers() -> None:
    flood = (sys.executable, "benchmarks/flood.py", "--seconds", "3", "--rate", "300")
    done = subprocess.run(
        (*flood, "--until", "plan_alpha"), cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for why in ("signature does not match", "not signed", "replayed"):  # they were there
        assert any(why in line for line in done.stdout.splitlines()), done.stdout
    for process in ("station", "vehicle", "world"):
        assert f"| {process} | 3 |" in done.stdout
