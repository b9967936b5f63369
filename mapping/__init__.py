"""What a map is, and how scans become one: the nouns that every room speaks."""
