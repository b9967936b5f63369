"""Teams drawn quickly, wrong edges put among their pairs, and what the merger makes of them."""
