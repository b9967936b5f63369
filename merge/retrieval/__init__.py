"""Retrieval: which maps of a large team probably show the same place."""
