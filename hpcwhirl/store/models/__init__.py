"""Files of engines and wheels: which arrays they have, of which kind. No mechanics."""
