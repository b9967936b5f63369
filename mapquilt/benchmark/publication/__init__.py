"""Data sets as other programs read them: pairs with their truth in Parquet or tar files, and their description."""
