"""A fixed set of generated pairs, merged and compared with what was recorded before."""
