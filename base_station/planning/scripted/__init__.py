"""Scripts that know what a push is. They tell what is feasible."""
