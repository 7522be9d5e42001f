"""Messages of all vehicles to tracks, on one clock and in one NED, cut into ticks."""
