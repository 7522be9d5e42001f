"""`hil campaign`: many runs in memory, from one file to one table and one report."""
