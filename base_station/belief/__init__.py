"""What the station believes of its fleet: is something wrong, what, how sure, what to try next."""
