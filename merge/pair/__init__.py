"""The pipeline of one pair: propose, align, verify, decide."""
