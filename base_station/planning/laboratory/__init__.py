"""The laboratory: layouts, the ladder of planners, and the reproduction of the paper."""
