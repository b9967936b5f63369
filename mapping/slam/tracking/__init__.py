"""Front end of SLAM: scans to points, to a local map of surfels, to poses, keyframes and links."""
