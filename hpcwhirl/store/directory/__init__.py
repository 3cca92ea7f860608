"""A campaign's directory while it runs: manifest, journals, states, owners."""
