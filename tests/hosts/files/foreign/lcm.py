"""Another module of that name."""


def lcm(a, b):
    return a * b
