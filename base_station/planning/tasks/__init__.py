"""What is to be learned or searched for: the experiment (alpha) and the mission (beta)."""
