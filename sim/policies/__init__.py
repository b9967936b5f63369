"""Policies: which goal a robot drives to next."""
