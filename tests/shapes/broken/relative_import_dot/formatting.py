def xy(p):
    return f'x: {p.x:.2f}, y: {p.y:.2f}'
