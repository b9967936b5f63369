"""What the method of chapter 5 does to maps, step by step, as pictures."""
