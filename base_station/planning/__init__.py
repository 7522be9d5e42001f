"""From a request of the station to a plan: tasks, and what plans for them."""
