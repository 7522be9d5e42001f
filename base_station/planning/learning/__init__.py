"""Learners: the only place that knows torch, stable-baselines3 and sb3-contrib."""
