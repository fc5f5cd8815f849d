"""Runs a command and prints its wall time (s) and peak resident memory (MB): python timed.py COMMAND ...

A process of its own, and a small one: a child's peak counts what its parent held when it was started.
"""

import os
import sys
import time

start = time.perf_counter()
child = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, 2, 1)])
_, status, usage = os.wait4(child, 0)
seconds = time.perf_counter() - start
print(seconds, usage.ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2))
sys.exit(os.waitstatus_to_exitcode(status))
