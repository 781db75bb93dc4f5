"""A bad network: passes datagrams between a server's port and one port for each client, and loses,
doubles and reorders.

    lossy_relay.py SERVER_PORT CLIENT_PORT,... LOSS TWICE LATE SEED [KIND]

Probabilities from 0 to 1, for each datagram, each way and each client apart; a late one comes after
the next. KIND: the first request of this kind (a number of request_t) is lost in any case.
"""

import random
import selectors
import socket
import struct
import sys

GROUP = "239.255.76.67"
REQUEST = b"ruedo/request\0"
KIND_AT = 44  # where a request's kind is
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


def kind_of(data):
    """The kind of the request in a datagram of LCM; None: it is none."""
    begin = data.find(REQUEST)
    if begin < 0:
        return None
    return int.from_bytes(data[begin + len(REQUEST) + KIND_AT :][:4], "big")


class Link:
    """One way to one port."""

    def __init__(self, sender, port, faults, seed, first_of=None):
        self.sender, self.to, self.first_of = sender, (GROUP, port), first_of
        self.loss, self.twice, self.late = faults
        self.random = random.Random(seed)
        self.held = None
        self.lost = 0

    def pass_on(self, data):
        held, self.held = self.held, None
        if self.first_of is not None and kind_of(data) == self.first_of:
            self.first_of = None
            self.lost += 1
        elif self.random.random() < self.loss:
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
    first_of = int(sys.argv[7]) if len(sys.argv) > 7 else None
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.bind(("", 0))
    own = sender.getsockname()[1]
    selector = selectors.DefaultSelector()
    down = [Link(sender, port, faults, seed + i) for i, port in enumerate(clients)]
    selector.register(listening(server), selectors.EVENT_READ, down)
    up = []
    for i, port in enumerate(clients):
        up.append(Link(sender, server, faults, seed + 1000 + i, first_of))
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
