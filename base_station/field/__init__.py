"""What an outing with real vehicles needs: consent, limits, one key that stops everything."""
