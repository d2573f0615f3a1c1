"""What MkDocs does beyond Markdown when it builds the site: reports, charts, and links into the repository."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import generated
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.plugins import get_plugin_logger
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
_LINK = re.compile(r"(\]\()(\.\./[^)\s]*)(\))")
_log = get_plugin_logger("rclpy-grader")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Take the address of the repository from pyproject.toml; with `repo_url`, pages would ask GitHub for its stars."""
    found = re.search(r'^repository = "(.+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise PluginError("pyproject.toml: expected the address of the repository, found none")
    config.extra["repository"] = found[1]
    config.extra["social"] = [{"icon": "fontawesome/brands/git-alt", "link": found[1], "name": "Source"}]
    return config


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the example reports, the charts of checks, and the release notes."""
    for path, content in generated.files().items():
        files.append(File.generated(config, path, content=content))
    files.append(File.generated(config, "changelog.md", abs_src_path=str(ROOT / "CHANGELOG.md")))
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, **_: Any) -> str:
    """Show what only the site has, and let links that leave `docs/` lead to the repository."""
    markdown = generated.for_site(markdown)
    folder = Path(config.docs_dir, page.file.src_uri).parent

    def outside(found: re.Match[str]) -> str:
        path, hash_, place = found[2].partition("#")
        target = Path(os.path.normpath(folder / path))
        if target.is_relative_to(config.docs_dir):
            return found[0]
        if not target.exists():
            _log.warning("%s: expected a file of the repository, found none at %s", page.file.src_uri, path)
        kind = "tree" if target.is_dir() else "blob"
        inside = target.relative_to(ROOT).as_posix()
        return f"{found[1]}{config.extra['repository']}/{kind}/main/{inside}{hash_}{place}{found[3]}"

    return _LINK.sub(outside, markdown)
