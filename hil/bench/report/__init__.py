"""`hil report`: what happened in a run, on one page that needs nothing else."""
