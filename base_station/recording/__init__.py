"""Recordings for Rerun; the only place that imports it."""

import os

# Files get their footer when they are merged; Rerun need not warn each time. Read when it loads.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=error")
