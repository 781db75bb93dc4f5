class square:
    def __init__(self, robot):
        pass

    def __call__(self, view):
        return "done"
