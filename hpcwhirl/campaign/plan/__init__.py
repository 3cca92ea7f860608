"""The cases of a campaign, from its TOML file, and their predicted computing times."""
