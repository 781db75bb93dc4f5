def drive(view):
    return 0.1, 0.0
