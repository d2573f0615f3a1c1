"""What the talker says."""


def word(number):
    return f"word {number}"
