"""Options that several verbs share, and what they parse to."""
