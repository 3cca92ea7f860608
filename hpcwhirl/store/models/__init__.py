"""Reading files of engines and wheels: arrays and their types. No mechanics."""
