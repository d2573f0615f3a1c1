"""Packages, executables and launch files: what a program is, and how it is started."""
