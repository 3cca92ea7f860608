"""Files: journals and traces while a campaign runs, `results.h5` when it is done."""
