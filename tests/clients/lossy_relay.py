"""A bad network: passes datagrams between a server's port and one port for each client, and loses,
doubles and reorders.

    lossy_relay.py SERVER_PORT CLIENT_PORT,... LOSS TWICE LATE SEED

Probabilities from 0 to 1, for each datagram, each way and each client apart; a late one comes after
the next.
"""

import random
import selectors
import socket
import struct
import sys

GROUP = "239.255.76.67"
MOST = 65536  # bytes of a datagram


def listening(port):
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    here.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    here.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    here.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    here.bind((GROUP, port))
    here.setsockopt(
        socket.IPPROTO_IP,
        socket.IP_ADD_MEMBERSHIP,
        struct.pack("4s4s", socket.inet_aton(GROUP), socket.inet_aton("0.0.0.0")),
    )
    return here


class Link:
    """One way to one port."""

    def __init__(self, sender, port, faults, seed):
        self.sender, self.to = sender, (GROUP, port)
        self.loss, self.twice, self.late = faults
        self.random = random.Random(seed)
        self.held = None
        self.lost = 0

    def pass_on(self, data):
        held, self.held = self.held, None
        if self.random.random() < self.loss:
            self.lost += 1
        elif self.random.random() < self.late:
            self.held = data
        else:
            self.sender.sendto(data, self.to)
            if self.random.random() < self.twice:
                self.sender.sendto(data, self.to)
        if held is not None:
            self.sender.sendto(held, self.to)


def main():
    server = int(sys.argv[1])
    clients = [int(port) for port in sys.argv[2].split(",")]
    faults = tuple(map(float, sys.argv[3:6]))
    seed = int(sys.argv[6])
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.bind(("", 0))
    own = sender.getsockname()[1]
    selector = selectors.DefaultSelector()
    down = [Link(sender, port, faults, seed + i) for i, port in enumerate(clients)]
    selector.register(listening(server), selectors.EVENT_READ, down)
    up = []
    for i, port in enumerate(clients):
        up.append(Link(sender, server, faults, seed + 1000 + i))
        selector.register(listening(port), selectors.EVENT_READ, [up[-1]])
    print("ready", flush=True)
    while True:
        for key, _ in selector.select():
            data, address = key.fileobj.recvfrom(MOST)
            if address[1] == own:
                continue  # what this relay has sent
            for link in key.data:
                link.pass_on(data)


if __name__ == "__main__":
    main()
