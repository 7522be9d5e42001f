"""What all processes share (scenario, airframe, faults, MAVLink values, links), and the bench."""
