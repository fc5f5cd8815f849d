"""What is said of designs, files and commands that are wrong: every row of corpus/errors, to the letter."""

import pytest
from messages import SAID, rows, said


@pytest.mark.parametrize(("file", "name", "row"), list(rows()), ids=lambda v: v if isinstance(v, str) else "")
def test_message(tmp_path, monkeypatch, file, name, row):
    """The same error, warnings and exit status; after a change that is meant, run scripts/snapshot_messages.py."""
    monkeypatch.chdir(tmp_path)
    given = {k: v for k, v in row.items() if k not in SAID}
    assert said(given) == {k: v for k, v in row.items() if k in SAID}
