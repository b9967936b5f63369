"""Navigation of one robot: routes, obstacle avoidance, right of way, recovery when stuck."""
