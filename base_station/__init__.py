"""A base station that doubts, experiments, decides and replans: it sees only MAVLink."""
