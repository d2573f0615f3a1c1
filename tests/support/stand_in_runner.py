"""A runner for composite actions, written again: expressions, environment files, outputs, a cache, commands in logs."""

import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tables import read_table

EXPRESSION = re.compile(r"\$\{\{(.*?)\}\}", re.DOTALL)
TOKEN = re.compile(r"\s*(?:(?P<string>'(?:[^']|'')*')|(?P<sign>==|!=|&&|\|\||[()!])|(?P<name>[a-z_][\w.-]*(?:\(\))?))")
SIGNS = {"&&": " and ", "||": " or ", "!": " not ", "==": "==", "!=": "!=", "(": "(", ")": ")"}
#: Kind, properties, message.
Command = tuple[str, dict[str, str], str]


@dataclass
class Job:
    """What a job leaves behind.

    Attributes:
        log: All that the steps printed.
        commands: (kind, properties, message) of each line that the runner obeyed.
        outputs: The outputs of the action.
        summaries: The step summaries, by step name.
        uploads: What was handed to other actions, by `uses`.
        changed: What the steps wrote to GITHUB_ENV, GITHUB_PATH and GITHUB_STATE.
        failed: Name of the step that failed, if one did.
    """

    log: str = ""
    commands: list[Command] = field(default_factory=list)
    outputs: dict[str, str] = field(default_factory=dict)
    summaries: dict[str, str] = field(default_factory=dict)
    uploads: dict[str, dict[str, str]] = field(default_factory=dict)
    changed: str = ""
    failed: str = ""


def run_action(action: Path, workspace: Path, folder: Path, environment: Mapping[str, str], **inputs: str) -> Job:
    """Run an action as a runner does: its steps in order, until one fails.

    Args:
        action: The folder of action.yml.
        workspace: The checkout.
        folder: Where the runner keeps its files; the folder `cache` beside it is the cache of the repository.
        environment: The job's environment.
        inputs: What the workflow gives, with `_` for `-`.
    """
    described = read_table(action / "action.yml")
    given = {name: str(value.get("default", "")) for name, value in described["inputs"].items()}
    for name, value in inputs.items():
        assert name.replace("_", "-") in given, name
        given[name.replace("_", "-")] = value
    temporary = folder / "temp"
    temporary.mkdir(parents=True)
    job = Job()
    steps: dict[str, Any] = {}
    names = {"GITHUB_ACTION_PATH": action, "GITHUB_WORKSPACE": workspace, "RUNNER_TEMP": temporary}
    environment = {**environment, **{name: str(value) for name, value in names.items()}, "GITHUB_ACTIONS": "true"}
    contexts = {"inputs": given, "steps": steps, "runner": {"temp": str(temporary)}}
    for number, step in enumerate(described["runs"]["steps"]):
        condition = step.get("if", "${{ true }}")
        expression = EXPRESSION.fullmatch(condition)
        assert expression, condition
        if evaluated(expression[1], contexts):
            run_step(step, folder / str(number), workspace, environment, contexts, job)
        if job.failed:
            break
    values = described["outputs"].items()
    job.outputs = {name: filled(output["value"], contexts) for name, output in values}
    return job


def run_step(
    step: Mapping[str, Any],
    folder: Path,
    workspace: Path,
    environment: Mapping[str, str],
    contexts: Mapping[str, Any],
    job: Job,
) -> None:
    """Run one step in the checkout, and take what it left in the environment files."""
    if "uses" in step:
        given = {name: filled(str(value), contexts) for name, value in step["with"].items()}
        kept = folder.parent.parent / "cache" / given.get("key", "")
        if step["uses"].startswith("actions/cache/restore@"):
            contexts["steps"][step["id"]] = {"outputs": {"cache-hit": str(kept.exists()).lower()}}
            if kept.exists():
                shutil.copytree(kept, given["path"], symlinks=True)
        elif step["uses"].startswith("actions/cache/save@"):
            shutil.copytree(given["path"], kept, symlinks=True)
        else:
            job.uploads[step["uses"]] = given
        return
    folder.mkdir()
    files = {name: folder / name for name in ("OUTPUT", "STEP_SUMMARY", "ENV", "PATH", "STATE")}
    for file in files.values():
        file.touch()
    script = folder / "script.sh"
    # A runner puts the values of expressions into the script before the shell reads it.
    script.write_text(filled(step["run"], contexts), encoding="utf-8")
    own = {name: filled(str(value), contexts) for name, value in step.get("env", {}).items()}
    words = ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail", str(script)]
    done = subprocess.run(
        words,
        cwd=workspace,
        env={**environment, **{f"GITHUB_{name}": str(file) for name, file in files.items()}, **own},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
    )
    text = done.stdout.decode("utf-8", errors="replace")
    job.log += text
    job.commands += obeyed(text)
    job.summaries[step["name"]] = files["STEP_SUMMARY"].read_text(encoding="utf-8")
    job.changed += "".join(files[name].read_text(encoding="utf-8") for name in ("ENV", "PATH", "STATE"))
    if "id" in step:
        contexts["steps"][step["id"]] = {"outputs": pairs(files["OUTPUT"].read_text(encoding="utf-8"))}
    if done.returncode:
        job.failed = step["name"]


def obeyed(text: str) -> list[Command]:
    """Return the commands in the log of a step: none between `stop-commands` and its token."""
    found: list[Command] = []
    token: str | None = None
    for line in re.split(r"\r\n|\r|\n", text):
        trimmed = line.lstrip()
        if token is not None:
            token = None if trimmed == f"::{token}::" else token
        elif trimmed.startswith("::") and (end := trimmed.find("::", 2)) >= 0:
            kind, _, rest = trimmed[2:end].partition(" ")
            if kind == "stop-commands":
                token = trimmed[end + 2 :]
            else:
                found.append((kind, dict(p.split("=", 1) for p in rest.split(",") if "=" in p), trimmed[end + 2 :]))
        elif (start := line.find("##[")) >= 0 and "]" in line[start:]:
            found.append((line[start + 3 : line.index("]", start)], {}, line[line.index("]", start) + 1 :]))
    assert token is None, "the runner was never told to listen again"
    return found


def pairs(text: str) -> dict[str, str]:
    """Return what an environment file says, in both of its forms."""
    values: dict[str, str] = {}
    lines = iter(text.splitlines())
    for line in lines:
        name, heredoc, end = line.partition("<<")
        if heredoc and "=" not in name:
            values[name] = "\n".join(iter(lambda: next(lines), end))
        else:
            name, equals, value = line.partition("=")
            assert equals, f"the runner would refuse {line!r}"
            values[name] = value
    return values


def filled(text: str, contexts: Mapping[str, Any]) -> str:
    """Return a text with its expressions replaced by their values."""
    return EXPRESSION.sub(lambda match: str(evaluated(match[1], contexts)), text)


def evaluated(expression: str, contexts: Mapping[str, Any]) -> Any:
    """Return the value of an expression: contexts, strings, comparisons, and the two words for truth."""
    pieces: list[str] = []
    place, expression = 0, expression.strip()
    while place < len(expression):
        match = TOKEN.match(expression, place)
        assert match, f"the stand-in does not know {expression[place:]!r}"
        if match["name"]:
            pieces.append(repr(named(match["name"], contexts)))
        else:
            pieces.append(SIGNS.get(match["sign"]) or repr((match["string"] or "")[1:-1].replace("''", "'")))
        place = match.end()
    return eval("".join(pieces), {"__builtins__": {}})


def named(name: str, contexts: Mapping[str, Any]) -> Any:
    """Return what a name in an expression stands for; what is unknown is empty, as it is to a runner."""
    if name in ("true", "false"):
        return name == "true"
    value: Any = contexts
    for part in name.split("."):
        value = value.get(part, "") if isinstance(value, dict) else ""
    return value


def job_environment(**more: str) -> dict[str, str]:
    """Return the environment of a job with tokens in it, none of which a student may learn."""
    kept = {name: os.environ[name] for name in ("PATH", "HOME", "LANG", "XDG_CACHE_HOME") if name in os.environ}
    tokens = ("ACTIONS_RUNTIME_TOKEN", "ACTIONS_ID_TOKEN_REQUEST_TOKEN", "GITHUB_TOKEN", "GH_TOKEN")
    return {**kept, **dict.fromkeys(tokens, CANARY), **more}


#: A token that must not turn up anywhere.
CANARY = "canary" + "0123456789abcdef" * 2
#: The folder of action.yml.
