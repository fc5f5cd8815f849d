"""What the command ``trabecula`` is made of, over the public names."""
