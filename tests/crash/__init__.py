"""Kill every verb that writes, at every step of its writing: ``python -m tests.crash``."""
