"""A campaign's directory while it runs: plan, journals, states, claims.

`campaign_directory.Directory` knows all files; each module holds one kind of them.
"""
