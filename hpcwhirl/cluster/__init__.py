"""Support for clusters: job scripts for schedulers, and a check of the machine."""
