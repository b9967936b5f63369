"""What other programs read and write to take part in a benchmark: maps without truth, and answers to them."""
