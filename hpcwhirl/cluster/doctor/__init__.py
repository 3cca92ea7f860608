"""What will break on this machine, and how to mend it: `hpcwhirl doctor`."""
