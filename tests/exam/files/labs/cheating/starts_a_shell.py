import subprocess

subprocess.run(["sh", "-c", "true"], check=True)
