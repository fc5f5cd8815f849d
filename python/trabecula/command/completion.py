"""Scripts by which shells complete the command, made from its own parser."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

__all__ = ["SHELLS", "script"]


class Word(NamedTuple):
    """An option, or an argument by its position."""

    #: Its names; none of an argument by its position.
    names: tuple[str, ...]
    help: str
    #: Whether a value follows it.
    takes: bool
    #: The values that there are, if they can be listed.
    choices: tuple[str, ...]
    #: The endings of the files that it may name, if it names one.
    suffixes: tuple[str, ...]


class Command(NamedTuple):
    """A command: its name, its line of help, its options and arguments."""

    name: str
    help: str
    words: tuple[Word, ...]

    @property
    def options(self) -> list[Word]:
        """Those with names."""
        return [word for word in self.words if word.names]

    @property
    def arguments(self) -> list[Word]:
        """Those by position."""
        return [word for word in self.words if not word.names]


def script(top: argparse.ArgumentParser, shell: str, values: dict[str, Sequence[str]]) -> str:
    """The script for a shell of ``SHELLS``; ``values`` are those of options that the parser leaves open, by destination."""
    return SHELLS[shell](list(commands_of(top, values)))


def commands_of(top: argparse.ArgumentParser, values: dict[str, Sequence[str]]) -> Iterator[Command]:
    """The commands of the parser, in its order."""
    (under,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
    for row in under._choices_actions:
        actions = under.choices[row.dest]._actions
        yield Command(row.dest, row.help or "", tuple(word_of(action, values) for action in actions))


def word_of(action: argparse.Action, values: dict[str, Sequence[str]]) -> Word:
    """What a shell has to know of an option or argument."""
    takes = action.nargs != 0
    choices = tuple(map(str, action.choices or values.get(action.dest, ()))) if takes else ()
    return Word(tuple(action.option_strings), action.help or "", takes, choices, getattr(action.type, "suffixes", ()))


# --- bash ------------------------------------------------------------------------------------------------------------

BASH = r"""# Completion of trabecula for bash.
_trabecula_files() {
  local name
  compopt -o filenames 2>/dev/null
  shopt -q nocasematch; local kept=$?
  shopt -s nocasematch
  while IFS= read -r name; do
    [[ -d $name || $name =~ \.($1)$ ]] && COMPREPLY+=("$name")
  done < <(compgen -f -- "$current")
  (( kept == 0 )) || shopt -u nocasematch
}
_trabecula_words() { COMPREPLY=($(compgen -W "$1" -- "$current")); }
_trabecula() {
  local current=${COMP_WORDS[COMP_CWORD]} last=${COMP_WORDS[COMP_CWORD-1]} command= i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    [[ ${COMP_WORDS[i]} == -* ]] || { command=${COMP_WORDS[i]}; break; }
  done
  case "$command $last" in
@VALUES@
  esac
  case "$command" in
    "") _trabecula_words "@COMMANDS@" ;;
@ARGUMENTS@
  esac
}
complete -F _trabecula trabecula
"""


def bash(commands: list[Command]) -> str:
    """For bash."""
    after, first = [], []
    for command in commands:
        for word in filter(lambda word: word.takes, command.options):
            where = " | ".join(f'"{command.name} {name}"' for name in word.names)
            after.append(f"    {where}) {bash_values(word)}return ;;")
        flags = " ".join(name for word in command.options for name in word.names)
        values = "".join(bash_values(word) for word in command.arguments[:1])
        first.append(
            f'    {command.name}) if [[ $current == -* ]]; then _trabecula_words "{flags}"; else {values or ": ;"} fi ;;'
        )
    made = BASH.replace("@VALUES@", "\n".join(after)).replace("@ARGUMENTS@", "\n".join(first))
    return made.replace("@COMMANDS@", " ".join(command.name for command in commands))


def bash_values(word: Word) -> str:
    """What completes a value: a command and a semicolon, or nothing."""
    if word.choices:
        return f'_trabecula_words "{" ".join(word.choices)}"; '
    return f'_trabecula_files "{"|".join(word.suffixes)}"; ' if word.suffixes else ""


# --- zsh -------------------------------------------------------------------------------------------------------------


def zsh(commands: list[Command]) -> str:
    """For zsh."""
    lines = ["#compdef trabecula", "# Completion of trabecula for zsh.", "_trabecula() {", "  local -a names", "  names=("]
    lines += [f"    {quoted(command.name + ':' + command.help)}" for command in commands]
    lines += ["  )", "  if (( CURRENT == 2 )); then _describe command names; return; fi"]
    lines += ["  local command=$words[2]", "  shift words", "  (( CURRENT-- ))", "  case $command in"]
    for command in commands:
        words = [zsh_option(name, word) for word in command.options for name in word.names]
        words += [f"{place}:argument:{zsh_values(word)}" for place, word in enumerate(command.arguments, 1)]
        lines.append(f"    {command.name}) _arguments " + " ".join(map(quoted, words)) + " ;;")
    lines += ["  esac", "}", "(( $+functions[compdef] )) && compdef _trabecula trabecula", ""]
    return "\n".join(lines)


def zsh_option(name: str, word: Word) -> str:
    """An option as ``_arguments`` takes it."""
    text = "".join("\\" + c if c in "[]:\\" else c for c in word.help)
    return f"{name}[{text}]" + (f":value:{zsh_values(word)}" if word.takes else "")


def zsh_values(word: Word) -> str:
    """What completes a value."""
    if word.choices:
        return f"({' '.join(word.choices)})"
    return f'_files -g "*.({"|".join(word.suffixes)})"' if word.suffixes else ""


# --- fish ------------------------------------------------------------------------------------------------------------


FISH = r"""# Completion of trabecula for fish.
function __trabecula_files
  __fish_complete_path (commandline -ct) | string match -ri '.*(?:/|\.(?:'$argv[1]'))(?=\t|$)'
end
complete -c trabecula -f"""


def fish(commands: list[Command]) -> str:
    """For fish."""
    lines = [FISH]
    for command in commands:
        line = f"complete -c trabecula -n __fish_use_subcommand -a {command.name} -d {fish_quoted(command.help)}"
        here = f"complete -c trabecula -n '__fish_seen_subcommand_from {command.name}'"
        lines += [line, *(here + fish_word(word) for word in command.words if word.names or fish_values(word))]
    return "\n".join([*lines, ""])


def fish_word(word: Word) -> str:
    """An option or argument as ``complete`` takes it."""
    names = "".join(f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}" for name in word.names)
    return names + (" -x" if word.names and word.takes else "") + fish_values(word) + f" -d {fish_quoted(word.help)}"


def fish_values(word: Word) -> str:
    """What completes a value."""
    if word.choices:
        return f" -a {fish_quoted(' '.join(word.choices))}"
    pattern = "|".join(word.suffixes)
    return f" -a '(__trabecula_files \"{pattern}\")'" if pattern else ""


def fish_quoted(text: str) -> str:
    """A text in fish's single quotes."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def quoted(text: str) -> str:
    """A text in single quotes, as shells of Bourne's kind read it."""
    return "'" + text.replace("'", "'\\''") + "'"


#: What makes the script of each shell.
SHELLS: dict[str, Callable[[list[Command]], str]] = {"bash": bash, "zsh": zsh, "fish": fish}
