"""Methods that others use or have published, by the cited descriptions: what the merger is measured against."""
