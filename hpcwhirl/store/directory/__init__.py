"""The files in a campaign's directory while it runs: plan, journals, states, claims.

`campaign_directory.Directory` knows all of them; each module reads and writes one kind.
"""
