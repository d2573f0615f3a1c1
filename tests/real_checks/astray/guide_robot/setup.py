"""A package that installs, as far as its files say."""

from setuptools import find_packages, setup

setup(
    name="guide_robot",
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/guide_robot"]),
        ("share/guide_robot", ["package.xml"]),
    ],
    install_requires=["setuptools"],
)
