"""Options that several verbs share, and their parsers."""
