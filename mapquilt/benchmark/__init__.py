"""Methods against pairs of maps whose transform is known: run, scored, counted, drawn."""
