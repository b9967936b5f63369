"""Worlds from other people's files."""
