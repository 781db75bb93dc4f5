import socket

bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
while True:
    bus.sendto(b"LC02" + bytes(60000), ("239.255.76.67", 7667))
