"""Parts that families share: floor plans, partitions and furniture."""
