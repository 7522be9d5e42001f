"""A base station that doubts, experiments, decides and replans. It sees only what a ground station sees."""
