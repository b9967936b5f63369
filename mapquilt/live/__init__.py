"""Merge of the maps of running robots: from messages in the order of their arrival to one map that does not jump."""
