"""Writes into corpus/errors what is said today of each row; review the difference with git.

Usage: python scripts/snapshot_messages.py [PART OF A FILE NAME ...]
"""

import os
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from messages import CORPUS, SAID, said, tomllib, written


def main(wanted):
    """Rewrites the files."""
    home = os.getcwd()
    for file in sorted(CORPUS.glob("*.toml")):
        if wanted and not any(w in file.name for w in wanted):
            continue
        text = file.read_text(encoding="utf-8")
        rows = tomllib.loads(text)
        out = []
        for block in re.split(r"(?m)^(?=\[\")", text):
            if not block.startswith('["'):
                out.append(block)
                continue
            (row,) = tomllib.loads(block).values()
            given = {k: v for k, v in row.items() if k not in SAID}
            with tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                found = said(given)
                os.chdir(home)
            first = re.search(rf"(?m)^({'|'.join(SAID)}) = ", block)
            own = block[: first.start()] if first else block.rstrip("\n") + "\n"
            out.append(own + written(found) + "\n\n")
        made = "".join(out).rstrip("\n") + "\n"
        same = {n: {k: v for k, v in r.items() if k not in SAID} for n, r in rows.items()}
        assert same == {n: {k: v for k, v in r.items() if k not in SAID} for n, r in tomllib.loads(made).items()}, file
        file.write_text(made, encoding="utf-8")
        print(f"{file.name}: {len(rows)} rows, {'as before' if made == text else 'changed'}")


if __name__ == "__main__":
    main(sys.argv[1:])
