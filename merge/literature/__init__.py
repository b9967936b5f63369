"""Published methods, by the cited descriptions, as baselines of the merger."""
