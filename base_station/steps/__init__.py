"""The paper's steps [0a]-[4]: each decides the orders of its phases, and the next phase."""
