"""What a campaign will take, before it runs."""
