"""Stands for `ament_index_python`: it knows the packages of the submission."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .context import Context
from .left_out import LeftOutError
from .package_names import PackageNotFoundError
from .unknown import Lacking


def ament_index(context: Context) -> dict[str, Any]:
    """Return what `ament_index_python` has: it knows the packages of the submission, and asks for no other in vain."""

    def share(package: str, *_: Any, **__: Any) -> str:
        return context.share_of(package)

    def unknown_to_us(package: object) -> None:
        if isinstance(package, str) and not context.know(package):
            context.leave_out_here(LeftOutError("package", package))

    def has_resource(resource_type: str, resource_name: str) -> Any:
        if resource_type != "packages":
            return Lacking("name", "ament_index_python.has_resource")
        unknown_to_us(resource_name)
        return context.prefix_of(resource_name) if resource_name in context.packages else False

    class Prefixes(dict[str, str]):
        """The prefixes of packages by name; whoever looks for another one is told that it is left out."""

        def __contains__(self, package: object) -> bool:
            unknown_to_us(package)
            return super().__contains__(package)

        def get(self, package: str, default: Any = None) -> Any:
            """Return the prefix of a package."""
            return super().get(package, default) if package in self else default

        def __missing__(self, package: str) -> str:
            return context.prefix_of(package)

    def prefixes() -> dict[str, str]:
        return Prefixes({package: context.prefix_of(package) for package in context.packages})

    def resources(resource_type: str) -> Any:
        return prefixes() if resource_type == "packages" else Lacking("name", "ament_index_python.get_resources")

    def search_paths() -> list[str]:
        return list(dict.fromkeys(context.prefix_of(package) for package in context.packages))

    return {
        "get_package_share_directory": share,
        "get_package_prefix": context.prefix_of,
        "get_package_share_path": lambda package, *_, **__: Path(context.share_of(package)),
        "get_packages_with_prefixes": prefixes,
        "get_resources": resources,
        "get_search_paths": search_paths,
        "has_resource": has_resource,
        "PackageNotFoundError": PackageNotFoundError,
        "RESOURCE_INDEX_SUBFOLDER": "share/ament_index/resource_index",
        "AMENT_PREFIX_PATH_ENV_VAR": "AMENT_PREFIX_PATH",
    }
