"""Shells complete the command: their own engines are asked, each where it is installed."""

import shutil
import subprocess

import pytest
from trabecula import beams, cell
from trabecula.base.islands import ISLANDS
from trabecula.command.cli import main
from trabecula.command.syntax import COMMANDS

BASH = """
source {script}
COMP_WORDS=({words}); COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
_trabecula
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def in_bash(folder, script, *words):
    return ("bash", "-c", BASH.format(script=script, words=" ".join(f"'{word}'" for word in ("trabecula", *words))))


def in_fish(folder, script, *words):
    line = " ".join(("trabecula", *words))
    return ("fish", "--no-config", "-c", f"source {script}; complete -C '{line}'")


@pytest.fixture(params=["bash", "fish"])
def completed(request, tmp_path, capsys, monkeypatch):
    shell = request.param
    if not shutil.which(shell):
        pytest.skip(f"{shell} is not installed")
    assert main(["completion", shell]) == 0
    script = tmp_path / "script"
    script.write_text(capsys.readouterr().out)
    folder = tmp_path / "here"
    (folder / "parts").mkdir(parents=True)
    for name in ("a.toml", "B.TOML", "stem.stl", "notes.txt", "x.3mf", "a b.json"):
        (folder / name).touch()

    def complete(*words):
        made = {"bash": in_bash, "fish": in_fish}[shell](folder, script, *words)
        done = subprocess.run(made, cwd=folder, capture_output=True, text=True, timeout=60, check=True)
        assert not done.stderr
        return {line.split("\t")[0].rstrip("/") for line in done.stdout.splitlines() if line}

    return complete


def test_commands(completed):
    assert completed("") >= set(COMMANDS)
    assert completed("per") == {"permeability"} and not completed("xyz")


def test_options_of_a_command(completed):
    assert {"--edge", "--per-cell", "--smooth", "--json"} <= completed("mesh", "--")
    assert "--layer" not in completed("mesh", "--") and "--layer" in completed("slice", "--")


def test_values(completed):
    assert completed("mesh", "--islands", "") == set(ISLANDS)
    assert completed("new", "--cell", "") == set(cell.names())
    assert completed("new", "--beams", "oct") == {name for name in beams.names() if name.startswith("oct")}
    assert completed("law", "fi") == {"fischer_koch_s"}
    assert completed("completion", "") == {"bash", "zsh", "fish"}


def test_files_by_their_endings(completed):
    """Designs for check, meshes to simplify; folders always, as files may lie within."""
    assert {"a.toml", "a b.json", "parts"} <= {name.replace("\\", "") for name in completed("check", "")}
    assert not {"notes.txt", "stem.stl"} & completed("check", "")
    assert completed("simplify", "s") == {"stem.stl"} and completed("simplify", "x") == {"x.3mf"}


@pytest.mark.skipif(not shutil.which("zsh"), reason="zsh is not installed")
def test_zsh_loads_the_script(tmp_path, capsys):
    """All that `_arguments` is given is parsed by itself: it complains of specifications that it cannot read."""
    assert main(["completion", "zsh"]) == 0
    (tmp_path / "_trabecula").write_text(capsys.readouterr().out)
    line = f"fpath=({tmp_path} $fpath); autoload -Uz compinit; compinit -D -u; print -r -- $_comps[trabecula]"
    done = subprocess.run(
        ["zsh", "-f", "-c", line + "; autoload +X _trabecula"], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == "_trabecula" and not done.stderr


def test_an_unknown_shell_is_refused(capsys):
    with pytest.raises(SystemExit) as left:
        main(["completion", "cmd"])
    assert left.value.code == 2
    assert "bash" in capsys.readouterr().err
