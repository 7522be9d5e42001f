"""One file a MAVLink microservice. Each maps message types to handlers that return replies."""
