"""Read worlds from other formats."""
