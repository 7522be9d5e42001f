"""The report of a campaign: scores, figures, a page."""
