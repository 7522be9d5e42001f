"""Searches for an experiment: they propose open-loop plans, the twin scores them."""
