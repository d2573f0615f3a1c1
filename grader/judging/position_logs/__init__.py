"""Recognises logged positions: text to numbers, numbers to labels, labelled numbers to the pose that was current."""
