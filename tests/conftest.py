"""Settings of all tests."""

from hypothesis import settings

# No wall-clock deadlines on a shared machine, and the same draws on every run.
settings.register_profile("mapquilt", deadline=None, derandomize=True)
settings.load_profile("mapquilt")
