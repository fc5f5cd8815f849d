#!/usr/bin/env python3
"""The command beside other programs: same geometry, same grid, whole process from start to a closed binary STL.

    python bench/peers.py --trabecula .venv/bin/trabecula [--n 128,256] [--repeat 5] [--peers-python PYTHON] [--record]

Runs are interleaved (every program once, then again), so that what else the machine does falls on all alike. Printed
are medians with the least and the greatest, the peak of resident memory, triangles and the relative error of the
volume. Peers that are not installed in PYTHON are left out. --record writes bench/record/DATE-MACHINE.csv too.
"""

import argparse
import csv
import datetime
import importlib.metadata
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import workloads as w

HERE = Path(__file__).resolve().parent
PEERS = {"vtk": "vtk", "skimage": "scikit-image", "mcubes": "PyMCubes"}


def processor():
    """The processor's name, where the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def versions(python):
    """{peer: version} of the peers that PYTHON has."""
    probe = (
        "import importlib.metadata as m, sys\n"
        "for p in sys.argv[1:]:\n"
        "    try: print(p, m.version(p))\n"
        "    except m.PackageNotFoundError: pass"
    )
    done = subprocess.run([python, "-c", probe, *PEERS.values()], capture_output=True, text=True, check=True)
    found = dict(line.split() for line in done.stdout.splitlines())
    return {peer: found[package] for peer, package in PEERS.items() if package in found}


def timed(words):
    """(seconds, peak MB) of a process; raises if it fails."""
    done = subprocess.run([sys.executable, "-IS", str(HERE / "timed.py"), *words], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{words[0]}: exit {done.returncode}: {done.stderr[-500:]}")
    seconds, peak = done.stdout.split()
    return float(seconds), float(peak)


def main():
    """Run, print, record."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--trabecula", default="trabecula", help="the command")
    options.add_argument("--peers-python", default=sys.executable, help="an interpreter that has the peers")
    options.add_argument("--n", default="128,256", help="samples along each axis, comma separated")
    options.add_argument("--work", default=",".join(w.WORKLOADS), help="workloads, comma separated")
    options.add_argument("--repeat", type=int, default=5)
    options.add_argument("--record", action="store_true", help="write bench/record/DATE-MACHINE.csv")
    a = options.parse_args()

    peers = versions(a.peers_python)
    own = subprocess.run([a.trabecula, "--version"], capture_output=True, text=True).stdout.strip()
    machine = f"{platform.system()} {platform.machine()}, {processor()}, {os.cpu_count()} threads"
    stamp = datetime.date.today().isoformat()
    print(f"{stamp}; {machine}; Python {platform.python_version()}; numpy {importlib.metadata.version('numpy')}")
    print(f"{own or 'trabecula'}; " + ("; ".join(f"{k} {v}" for k, v in peers.items()) or "no peers installed"))

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "out.stl")
        for work in a.work.split(","):
            text = Path(folder) / f"{work}.toml"
            text.write_text(w.design(work))
            exact = w.WORKLOADS[work][2]
            for n in map(int, a.n.split(",")):
                runs = {"trabecula": [a.trabecula, "mesh", str(text), "-o", out, "--edge", repr(w.spacing(n))]}
                runs |= {p: [a.peers_python, str(HERE / "peer.py"), p, work, str(n), out] for p in peers}
                taken, facts = {p: [] for p in runs}, {}
                for _ in range(a.repeat):
                    for peer, words in runs.items():
                        taken[peer].append(timed(words))
                        facts.setdefault(peer, w.read_volume(out))
                        os.remove(out)
                print(
                    f"\n{work}, n = {n}\n  {'':12} {'median s':>9} {'least':>8} {'greatest':>8} {'MB':>7}"
                    f" {'triangles':>10} {'volume error':>13}"
                )
                for peer, pairs in taken.items():
                    seconds, peak = [s for s, _ in pairs], max(m for _, m in pairs)
                    triangles, volume = facts[peer]
                    row = [statistics.median(seconds), min(seconds), max(seconds), peak, triangles, volume / exact - 1]
                    print("  {:12} {:9.3f} {:8.3f} {:8.3f} {:7.0f} {:10d} {:13.2e}".format(peer, *row))
                    rows.append([work, n, peer, peers.get(peer, own), *row])
    if a.record:
        name = "".join(c if c.isalnum() else "-" for c in platform.node() or "machine")
        path = HERE / "record" / f"{stamp}-{name}.csv"
        path.parent.mkdir(exist_ok=True)
        with path.open("w", newline="") as file:
            file.write(f"# {machine}; {a.repeat} interleaved runs\n")
            writer = csv.writer(file)
            writer.writerow(
                [
                    "work",
                    "n",
                    "program",
                    "version",
                    "median_s",
                    "min_s",
                    "max_s",
                    "peak_mb",
                    "triangles",
                    "volume_error",
                ]
            )
            writer.writerows(rows)
        print(f"\n{path}")


if __name__ == "__main__":
    main()
