"""Records of one robot: scans, trajectories and logs."""
