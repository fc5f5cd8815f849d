"""Where the time of a command goes, by modules of the core: samples of its program counter (Linux, `perf` and `addr2line`).

  CARGO_PROFILE_RELEASE_DEBUG=line-tables-only CARGO_PROFILE_RELEASE_STRIP=none make
  python bench/profile.py [--least 2] .venv/bin/trabecula mesh examples/wrapped_tube.toml -o part.stl

A sample belongs to the innermost function of the core that was inlined there, but for vectors and matrices; shares are of the
CPU time of all threads.
"""

import argparse
import bisect
import collections
import re
import struct
import subprocess
import tempfile

# Parts of a module's path that are told.
DEPTH = 2
# What is told by what uses it.
COMMON = ("geometry/math", "geometry/cubic_spline")
MAP = re.compile(r"MMAP2?.*\[(0x[0-9a-f]+)\((0x[0-9a-f]+)\) @ (0x[0-9a-f]+|0).*\]: r-xp (\S+)")
SAMPLE = re.compile(r"\s*([0-9a-f]+) \((.*)\)")


def samples(command):
    """Counts by (file, offset in it), of all samples of a command."""
    with tempfile.NamedTemporaryFile() as out:
        record = ["perf", "record", "--quiet", "-F", "499", "-o", out.name, "--", *command]
        subprocess.run(record, check=True, stdout=subprocess.DEVNULL)
        script = ["perf", "script", "-i", out.name, "-F", "ip,dso", "--show-mmap-events"]
        text = subprocess.run(script, check=True, capture_output=True, text=True).stdout
    maps, found = [], collections.Counter()
    for line in text.splitlines():
        if mapped := MAP.search(line):
            start, length, offset = (int(v, 16) for v in mapped.groups()[:3])
            bisect.insort(maps, (start, length, offset, mapped[4]))
        elif sample := SAMPLE.fullmatch(line):
            at = int(sample[1], 16)
            i = bisect.bisect_right(maps, (at, 1 << 63)) - 1
            if i >= 0 and at < maps[i][0] + maps[i][1]:
                found[maps[i][3], at - maps[i][0] + maps[i][2]] += 1
            else:
                found["kernel", at] += 1
    return found


def addresses(path, offsets):
    """The virtual addresses of offsets in an ELF file, by its loaded segments."""
    with open(path, "rb") as file:
        data = file.read(1 << 16)
    table, size, count = *struct.unpack_from("<Q", data, 32), *struct.unpack_from("<HH", data, 54)
    segments = [struct.unpack_from("<IIQQQQ", data, table + i * size) for i in range(count)]
    loads = [(offset, offset + length, address - offset) for kind, _, offset, address, _, length in segments if kind == 1]
    return [next((o + by for low, high, by in loads if low <= o < high), o) for o in offsets]


def modules(path, offsets):
    """The module of each offset in a program or library; its name where no source of the core is known."""
    query = "\n".join(map(hex, addresses(path, offsets)))
    told = subprocess.run(["addr2line", "-a", "-i", "-e", path], input=query, capture_output=True, text=True).stdout
    for block in re.split(r"^0x[0-9a-f]+\n", told, flags=re.M)[1:]:
        sources = (f"{crate}/{file}" for crate, file in re.findall(r"crates/([\w-]+)/src/([\w/]+)\.rs", block))
        source = next((s for s in sources if s not in COMMON), path.rsplit("/", 1)[-1])
        yield "/".join(source.split("/")[: 1 + DEPTH])


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--least", type=float, default=2.0, help="the least share that is printed, %%")
    ask.add_argument("command", nargs=argparse.REMAINDER)
    asked = ask.parse_args()
    found, shares = samples(asked.command), collections.Counter()
    for path in {path for path, _ in found}:
        offsets = [o for p, o in found if p == path]
        names = modules(path, offsets) if path.startswith("/") else [path] * len(offsets)
        for offset, name in zip(offsets, names, strict=True):
            shares[name] += found[path, offset]
    for name, count in shares.most_common():
        if (share := 100 * count / found.total()) >= asked.least:
            print(f"{share:5.1f} %  {name}")


main()
