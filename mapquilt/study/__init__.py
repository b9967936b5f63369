"""How well maps are merged as one setting, or two, change while all else stays the same."""
