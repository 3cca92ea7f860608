"""Benchmarks: time of a time step, and cost and error of solver settings.

`bench` is for `hpcwhirl bench`. For `hpcwhirl tradeoff`, `trials` holds
the settings to compare, `drawing` draws cases of a campaign, `tradeoff` measures,
`numbers` compares, `wish` chooses a setting, `applied` writes it to a file.
"""
