"""Sweeps: many designs of one, as a table with a row for each."""
