"""The workbench: command line, runs, scores and pictures."""
