"""A simulated vehicle: an autopilot with sensors, an estimator and MAVLink services."""
