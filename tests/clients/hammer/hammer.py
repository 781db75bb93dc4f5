"""Eight threads that subscribe, publish and leave while a ninth receives, until each has done so
COUNT times or for SECONDS; then a message still gets through. hammer.cpp and Hammer.java are its
twins.

    hammer.py URL COUNT SECONDS
"""

import sys
import threading
import time

from ruedo.transport.bus import Bus
from ruedo.transport.transport import open_transport

THREADS, CHANNELS = 8, 4


def main():
    url, count, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    bus = Bus(open_transport(url))
    heard, standing, failures = [0] * THREADS, [0], []

    def stand(data):
        standing[0] += 1
        if standing[0] % 50 == 1:
            raise SystemExit("what a callback raises hurts nobody")

    # The threads' subscriptions may all be closed before an echo comes; this one stays open.
    steady = bus.subscribe("hammer/shared0", stand)
    bus.start()
    end = time.monotonic() + seconds

    def hammer(number):
        def hear(data):
            heard[number] += 1
            if heard[number] % 7 == 0:
                bus.subscribe(f"hammer/within{number}", hear).close()
            if heard[number] % 50 == 1:
                raise SystemExit("what a callback raises hurts nobody")

        try:
            done = 0
            while done < count or time.monotonic() < end:
                own = bus.subscribe(f"hammer/{number}/{done % CHANNELS}", hear)
                shared = bus.subscribe(f"hammer/shared{done % CHANNELS}", hear)
                for k in range(CHANNELS):
                    bus.publish(f"hammer/shared{k}", b"shared")
                    bus.publish(f"hammer/{number}/{k}", b"own" * 100)
                shared.close()
                own.close()
                done += 1
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=hammer, args=(number,)) for number in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures, failures
    through = threading.Event()
    last = bus.subscribe("hammer/last", lambda data: through.set())
    while not through.wait(0.05):
        bus.publish("hammer/last", b"last")
    last.close()
    steady.close()
    bus.close()
    print("heard", sum(heard + standing) > 0)


main()
