"""A child process that does not outlive its parent, not even one that is SIGKILLed."""

import ctypes
import os
import signal
import sys
from collections.abc import Callable

_PR_SET_PDEATHSIG = 1
_PARENT_GONE = 1


def dying_with_parent() -> Callable[[], None] | None:
    """For `subprocess.Popen(preexec_fn=...)`: the kernel sends SIGKILL when this process is gone.

    Only Linux has that (prctl(2), PR_SET_PDEATHSIG); elsewhere it is None, and a child has to
    notice for itself that its links have fallen silent.
    """
    if sys.platform != "linux":
        return None
    prctl, parent = ctypes.CDLL(None).prctl, os.getpid()

    def ask() -> None:
        prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
        if os.getppid() != parent:
            os._exit(_PARENT_GONE)

    return ask
