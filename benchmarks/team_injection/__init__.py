"""Synthetic teams of maps, wrong answers injected among their pairs, and the merger's results on them."""
