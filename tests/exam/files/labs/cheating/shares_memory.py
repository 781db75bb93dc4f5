from multiprocessing import shared_memory

shared_memory.SharedMemory("filter", create=True, size=1 << 30)
