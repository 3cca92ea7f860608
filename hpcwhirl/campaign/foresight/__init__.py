"""Forecast of the time and disk space of a campaign."""
