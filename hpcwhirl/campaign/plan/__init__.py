"""Which cases a campaign has, as what each is computed, and what it may cost."""
