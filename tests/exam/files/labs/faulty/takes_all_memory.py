taken = []
while True:
    taken.append(bytearray(100_000_000))
