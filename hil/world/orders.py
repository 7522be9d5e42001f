"""What whoever holds the world's leash tells it, as lines (pure).

until 12.5
break {"vehicle": 2, "unit": "motor", "type": "off", "instances": [3], "applied_by": "world"}
mend {"vehicle": 2, "unit": "motor", "type": "off", "instances": [3], "applied_by": "world"}
"""

from dataclasses import dataclass

from pydantic import ValidationError

from hil.errors import InputError
from hil.scenario import FaultModel

MAX_SHOWN = 200


@dataclass(frozen=True)
class Until:
    """The world time (s) not to pass."""

    time_s: float


@dataclass(frozen=True)
class Break:
    """A fault for the world to apply, from its next step on."""

    fault: FaultModel


@dataclass(frozen=True)
class Mend:
    """The end of all faults of the same vehicle, unit and instances."""

    fault: FaultModel


Order = Until | Break | Mend


def order_line(order: Order) -> str:
    """The line for an order, without its end."""
    match order:
        case Until(time_s):
            return f"until {time_s:.6f}"
        case Break(fault):
            return f"break {fault.model_dump_json()}"
        case Mend(fault):
            return f"mend {fault.model_dump_json()}"


def parse_order(line: str) -> Order | None:
    """The inverse; None for what is no order. Raises InputError for a fault that can't be."""
    word, _, rest = line.partition(" ")
    if word == "until":
        try:
            return Until(float(rest))
        except ValueError:
            return None
    if word not in ("break", "mend"):
        return None
    try:
        fault = FaultModel.model_validate_json(rest)
    except ValidationError as error:
        why = error.errors()[0]["msg"]
        raise InputError(f"order to the world: {line[:MAX_SHOWN]}: {why}") from None
    return Break(fault) if word == "break" else Mend(fault)


class OrderReader:
    """Cuts what comes in pieces into orders."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Order]:
        """The orders that are whole now. Raises as `parse_order`."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        orders = (parse_order(line.decode(errors="replace")) for line in lines)
        return [order for order in orders if order is not None]
