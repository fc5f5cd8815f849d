"""Work that outgrows one process or one run: ranges of a part, by threads or a cluster, in a folder that outlives them."""
