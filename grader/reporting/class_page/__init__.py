"""The page of a class: how everybody stands, what was lost where, and why; rendered from plain values."""
