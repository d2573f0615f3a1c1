def half(speed):
    return speed / 2
