"""A large part by threads, by workers and in a run that can be taken up again: seconds, peak memory of processes, equal bytes.

  python bench/large.py --trabecula .venv/bin/trabecula --voxels 1e9 [--of mesh measure voxels slice] [--workers 2]
    [--folder /big/disk] [--rounds 1]

A gyroid network in a box of 40 mm on a grid of about this number of cells. A file is written, hashed and removed before the
next one. Each round has all ways in turn, and threads come last once more, so that what else the machine does shows. The start
of each way (imports, scheduler, workers) is measured on 64000 cells, and taken off its seconds ("net s") and CPU seconds ("net
CPU s"); "of threads" is by net CPU seconds. What 1e11 voxels take is estimated from the last rate.
"""

import argparse
import hashlib
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time

TEXT = """schema = 1
units = "mm"
region.box.size = [40, 40, 40]
[lattice.core]
cell = "gyroid"
part = "lower"
map.affine.wavelength = 4
map.affine.rotate = [3, 5, 7]
level.fraction = 0.3
"""
ENDING = {"mesh": "stl", "voxels": "npy", "slice": "cli"}
#: The option that takes the edge: layers of slice are as high as voxels.
STEP = {"voxels": "--step", "slice": "--layer"}
LARGE = 1e11


class Peaks(threading.Thread):
    """The peak memory (MB) of a process and of all that it starts, seen every half second."""

    def __init__(self, pid):
        super().__init__(daemon=True)
        self.pid, self.peaks, self.ended = pid, {}, threading.Event()

    def run(self):
        while not self.ended.wait(0.5):
            waiting = [self.pid]
            while waiting:
                pid = waiting.pop()
                try:
                    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
                        waiting += map(int, (task / "children").read_text().split())
                    status = pathlib.Path(f"/proc/{pid}/status").read_text()
                except OSError:
                    continue
                for line in status.splitlines():
                    if line.startswith("VmHWM"):
                        self.peaks[pid] = max(self.peaks.get(pid, 0), int(line.split()[1]) / 1024)


def run(command):
    """Seconds and CPU seconds, the peaks of the process itself and of the largest that it starts, and what it prints."""
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    peaks = Peaks(child.pid)
    peaks.start()
    out, said = child.communicate()
    peaks.ended.set()
    if child.returncode:
        raise SystemExit(f"{' '.join(command)}: {said[-500:]}")
    peaks.join()
    others = [peak for pid, peak in peaks.peaks.items() if pid != child.pid]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, busy, peaks.peaks.get(child.pid, 0.0), max(others, default=0.0), json.loads(out)


def digest(path):
    """The SHA-256 of a file."""
    made = hashlib.sha256()
    with open(path, "rb") as file:
        while chunk := file.read(1 << 24):
            made.update(chunk)
    return made.hexdigest()


def command_of(trabecula, of, scratch, edge, way):
    """The command that makes the part in a folder at an edge (mm)."""
    written = [] if of == "measure" else ["-o", str(pathlib.Path(scratch) / f"part.{ENDING[of]}")]
    step = [STEP.get(of, "--edge"), f"{edge:.9g}"]
    return [trabecula, of, str(pathlib.Path(scratch) / "part.toml"), *written, *step, *way, "--json"]


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--trabecula", required=True)
    ask.add_argument("--voxels", type=float, default=1e9)
    ask.add_argument("--of", nargs="+", choices=("mesh", "measure", "voxels", "slice"), default=["mesh"])
    ask.add_argument("--workers", type=int, default=2)
    ask.add_argument("--folder", help="where files are written")
    ask.add_argument("--rounds", type=int, default=1)
    asked = ask.parse_args()
    edge = 40 / asked.voxels ** (1 / 3)
    with tempfile.TemporaryDirectory(dir=asked.folder) as scratch:
        design = pathlib.Path(scratch) / "part.toml"
        design.write_text(TEXT)
        for of in asked.of:
            threads, cluster = ["--threads", str(asked.workers)], ["--cluster", f"local:{asked.workers}"]
            ways = {"threads": threads, "workers": cluster}
            ways |= {"resumable": [*threads, "--resume"]} if of != "measure" else {}
            print(f"{of}, {asked.voxels:.1e} voxels, edge {edge:.6g} mm")
            titles = ("s", "net s", "CPU s", "net CPU s", "of threads", "MB", "worker MB")
            print(f"{'way':10}", *(f"{title:>10}" for title in titles), " bytes")
            seen, base, start = {}, None, {}
            for name in ways:
                out = pathlib.Path(scratch) / f"part.{ENDING.get(of)}"
                start[name] = run(command_of(asked.trabecula, of, scratch, 1.0, ways[name]))[:2]
                out.unlink(missing_ok=True)
                print(f"{name:10} {start[name][0]:10.1f} {'':10} {start[name][1]:10.1f}  to start", flush=True)
            for name in [n for _ in range(asked.rounds) for n in ways] + ["threads"]:
                seconds, busy, own, worker, printed = run(command_of(asked.trabecula, of, scratch, edge, ways[name]))
                printed.pop("seconds", None)
                size = out.stat().st_size if of != "measure" else 0
                found = {"file": digest(out) if size else "", **printed}
                for key in (key for key in found if seen.setdefault(key, found[key]) != found[key]):
                    sys.exit(f"{name}: {key} is {found[key]}, of threads {seen[key]}")
                out.unlink(missing_ok=True)
                net, net_busy = seconds - start[name][0], busy - start[name][1]
                base = net_busy if name == "threads" else base
                rate, figures = asked.voxels / seconds, (seconds, net, busy, net_busy)
                columns = [f"{x:10.1f}" for x in figures] + [
                    f"{100 * base / net_busy:8.0f} %",
                    f"{own:10.0f}",
                    f"{worker:10.0f}",
                ]
                print(f"{name:10}", *columns, f" {size:.3e}", flush=True)
            print("equal bytes and figures")
            more = size * (LARGE / asked.voxels) if of == "voxels" else size * (LARGE / asked.voxels) ** (2 / 3)
            print(f"{LARGE:.0e} voxels at this rate: {LARGE / rate / 3600:.1f} h, {more:.2e} bytes\n")
        print(f"{os.cpu_count()} processors, {shutil.disk_usage(scratch).free:.2e} bytes free")


if __name__ == "__main__":
    main()
