"""What a cluster asks for: job scripts for schedulers, and what will break there."""
