"""The page to align maps by hand: session, measurements, matching, files and the server on the loopback."""
