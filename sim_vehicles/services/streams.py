"""Streams: which message goes out when, and the requests that change it.

MAV_CMD_SET_MESSAGE_INTERVAL, GET_MESSAGE_INTERVAL, REQUEST_MESSAGE and REQUEST_DATA_STREAM.
"""

import math
from collections.abc import Callable, Mapping

from hil.mavlink import (
    Command,
    Message,
    MessageId,
    MessageInterval,
    RequestDataStream,
    Result,
)
from sim_vehicles.services.commands import DENIED, UNSUPPORTED, Executor, Order, Outcome
from sim_vehicles.services.service import Handlers, Replies, Request

Builder = Callable[[], Message | None]
EPSILON_S = 1e-6

# MAV_DATA_STREAM to messages, as ArduPilot Rover groups them
GROUPS: Mapping[int, tuple[MessageId, ...]] = {
    1: (MessageId.RAW_IMU,),
    2: (
        MessageId.SYS_STATUS,
        MessageId.GPS_RAW_INT,
        MessageId.MISSION_CURRENT,
        MessageId.FENCE_STATUS,
    ),
    3: (MessageId.SERVO_OUTPUT_RAW, MessageId.RC_CHANNELS),
    6: (MessageId.GLOBAL_POSITION_INT, MessageId.LOCAL_POSITION_NED),
    10: (MessageId.ATTITUDE,),
    11: (MessageId.VFR_HUD,),
    12: (
        MessageId.BATTERY_STATUS,
        MessageId.EKF_STATUS_REPORT,
        MessageId.ESC_TELEMETRY_1_TO_4,
    ),
}


def default_rates_hz(telemetry_hz: float) -> dict[int, float]:
    """What streams unprompted on the station's port; all else only when asked for."""
    return {
        MessageId.HEARTBEAT: 1.0,
        MessageId.SYS_STATUS: 1.0,
        MessageId.GPS_RAW_INT: 2.0,
        MessageId.GLOBAL_POSITION_INT: 2.0,
        MessageId.LOCAL_POSITION_NED: telemetry_hz,
        MessageId.ATTITUDE: telemetry_hz,
        MessageId.SERVO_OUTPUT_RAW: 2.0,
        MessageId.BATTERY_STATUS: 0.5,
        MessageId.EXTENDED_SYS_STATE: 1.0,
        MessageId.HOME_POSITION: 0.5,
        MessageId.GPS_GLOBAL_ORIGIN: 0.5,
        MessageId.MISSION_CURRENT: 1.0,
    }


class StreamService:
    """Builds messages when they are due. Times are multiples of the interval, so fleets align."""

    def __init__(self, builders: Mapping[int, Builder], rates_hz: Mapping[int, float]) -> None:
        self._builders = dict(builders)
        self._defaults = {number: 1.0 / hz for number, hz in rates_hz.items()}
        self._intervals = dict(self._defaults)
        self._due = dict.fromkeys(self._intervals, 0.0)
        self._next_s = 0.0

    def handlers(self) -> Handlers:
        return {RequestDataStream: self._request_stream}

    def executors(self) -> Mapping[int, Executor]:
        return {
            Command.SET_MESSAGE_INTERVAL: self._set_interval,
            Command.GET_MESSAGE_INTERVAL: self._get_interval,
            Command.REQUEST_MESSAGE: self._request_message,
            Command.REQUEST_AUTOPILOT_CAPABILITIES: self._request_version,
            Command.GET_HOME_POSITION: self._request_home,
        }

    def step(self, now_s: float) -> list[Message]:
        """What is due at vehicle time `now_s`."""
        if now_s + EPSILON_S < self._next_s:
            return []
        messages = []
        for number, due_s in self._due.items():
            if now_s + EPSILON_S >= due_s:
                interval_s = self._intervals[number]
                whole = math.floor(now_s / interval_s + EPSILON_S) + 1
                self._due[number] = whole * interval_s
                message = self._builders[number]()
                if message is not None:
                    messages.append(message)
        self._next_s = min(self._due.values(), default=math.inf)
        return messages

    def _set(self, number: int, interval_s: float | None, now_s: float) -> None:
        if interval_s is None:
            self._intervals.pop(number, None)
            self._due.pop(number, None)
        else:
            self._intervals[number] = interval_s
            self._due[number] = now_s
        self._next_s = now_s

    def _set_interval(self, order: Order) -> Outcome:
        """Param 2 is the interval in us: -1 switches off, 0 asks for the default."""
        number, interval_us = order.integer(1), order.params[1]
        if number not in self._builders or number is None:
            return UNSUPPORTED
        if interval_us == 0:
            self._set(number, self._defaults.get(number), order.now_s)
        elif interval_us == -1:
            self._set(number, None, order.now_s)
        elif interval_us > 0 and math.isfinite(interval_us):
            self._set(number, interval_us / 1e6, order.now_s)
        else:
            return DENIED
        return Outcome(Result.ACCEPTED)

    def _get_interval(self, order: Order) -> Outcome:
        number = order.integer(1)
        if number is None or not 0 <= number <= 65535:
            return DENIED
        if number not in self._builders:
            return Outcome(Result.UNSUPPORTED, (MessageInterval(number, 0),))
        interval_s = self._intervals.get(number)
        interval_us = -1 if interval_s is None else round(interval_s * 1e6)
        return Outcome(Result.ACCEPTED, (MessageInterval(number, interval_us),))

    def _request_message(self, order: Order) -> Outcome:
        return self._once(order.integer(1))

    def _request_version(self, _order: Order) -> Outcome:
        return self._once(MessageId.AUTOPILOT_VERSION)

    def _request_home(self, _order: Order) -> Outcome:
        return self._once(MessageId.HOME_POSITION)

    def _once(self, number: int | None) -> Outcome:
        """ACCEPTED only together with the message: clients stall on a promise not kept."""
        builder = self._builders.get(-1 if number is None else number)
        if builder is None:
            return UNSUPPORTED
        message = builder()
        if message is None:
            return Outcome(Result.TEMPORARILY_REJECTED)
        return Outcome(Result.ACCEPTED, (message,))

    def _request_stream(self, request: Request) -> Replies:
        value: RequestDataStream = request.value
        chosen = GROUPS.values() if value.stream_id == 0 else [GROUPS.get(value.stream_id, ())]
        interval_s = 1.0 / value.rate_hz if value.start and value.rate_hz > 0 else None
        for number in (number for group in chosen for number in group):
            if number in self._builders:
                self._set(number, interval_s, request.now_s)
        return []
