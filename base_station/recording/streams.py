"""Streams of the one recording: into a file, or to a viewer."""

import logging
import socket
from pathlib import Path
from typing import Any

import rerun as rr

APPLICATION_ID = "hil"
VIEWER = "127.0.0.1:9876"
FILE_PERIOD_S, VIEWER_PERIOD_S = 0.7, 0.2  # how long rows may be kept back
PROBE_S = 0.3

log = logging.getLogger(__name__)


def to_file(path: Path, run_id: str, blueprint: Any = None) -> Any:
    """A stream into a file. A SIGKILL costs what came less than 1 s before."""
    path.touch()  # before a stream exists that would be left without a sink
    stream = _stream(run_id, FILE_PERIOD_S)
    # a footer lists all chunks, and memory keeps the list: 1 MB a minute; `merge` adds one later
    stream.set_sinks(rr.FileSink(str(path), write_footer=False), default_blueprint=blueprint)
    return stream


def to_viewer(address: str, run_id: str, blueprint: Any = None) -> Any | None:
    """A stream to the viewer at host:port, or None when nobody listens there."""
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=PROBE_S).close()
    except (OSError, ValueError) as error:
        log.warning("no Rerun viewer at %s (%s): recording to the file only", address, error)
        return None
    stream = _stream(run_id, VIEWER_PERIOD_S)
    stream.set_sinks(rr.GrpcSink(f"rerun+http://{address}/proxy"))
    if blueprint is not None:
        stream.send_blueprint(blueprint)
    return stream


def _stream(run_id: str, period_s: float) -> Any:
    config = rr.ChunkBatcherConfig(flush_tick=period_s)
    stream = rr.RecordingStream(
        APPLICATION_ID, recording_id=run_id, send_properties=False, batcher_config=config
    )
    stream.set_log_time_enabled(False)  # wall_time says it
    stream.set_log_tick_enabled(False)
    return stream


def abandon() -> None:
    """Leave a viewer that no longer reads: at exit, Rerun would wait for it for ever."""
    log.warning("the Rerun viewer does not read any more: left without goodbye")
    rr.unregister_shutdown()
