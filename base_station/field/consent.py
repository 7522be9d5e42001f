"""Nothing that could be real is armed before somebody has said so."""

import sys
from collections.abc import Callable

from hil.errors import InputError
from hil.scenario import StationView

WORD = "arm"


def ask_before_arming(view: StationView, read: Callable[[], str] = sys.stdin.readline) -> None:
    """Ask where any link leaves this machine. Raises InputError unless the answer is `arm`."""
    real = [m.name for m in view.fleet if not view.connection_of(m).is_on_this_machine]
    if not real:
        return
    print(
        f"{', '.join(real)} may be real. Wheels off the ground or everybody clear, transmitter in "
        f"hand, docs/real-vehicles.md read? Type {WORD} to arm: ",
        end="",
        flush=True,
    )
    if read().strip() != WORD:
        raise InputError("not armed: no confirmation; nothing was sent")
