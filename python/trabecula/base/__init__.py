"""What all else stands on: what callers give, files and their formats, data in memory, words for figures, the terminal."""
