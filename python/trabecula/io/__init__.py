"""Files and objects of other programs, and the processes of their own in which other packages read them."""
