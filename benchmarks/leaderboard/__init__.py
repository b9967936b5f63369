"""Leaderboard: results of methods on published data, scored from the methods' answers, and checked again."""
