"""Forecast of a campaign's computing time and disk space, before it is run."""
