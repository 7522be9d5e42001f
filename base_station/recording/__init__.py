"""Recordings for Rerun; the only place that imports it."""
