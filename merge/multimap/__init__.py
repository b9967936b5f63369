"""More than two maps: pair selection, consistency, clusters and joint refinement."""
