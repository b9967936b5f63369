"""Parts that families share: floor plans, partitions, furniture."""
