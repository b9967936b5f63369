"""Draw worlds as architects draw floor plans."""
