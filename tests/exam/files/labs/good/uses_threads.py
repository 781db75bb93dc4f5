"""Around the solution: drives from a thread."""

import threading


def around(program):
    def in_thread(robot):
        thread = threading.Thread(target=program, args=(robot,))
        thread.start()
        thread.join()

    return in_thread
