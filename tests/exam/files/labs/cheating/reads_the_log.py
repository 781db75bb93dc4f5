import os
import tempfile

print(os.listdir("/tmp"), tempfile.gettempdir())
