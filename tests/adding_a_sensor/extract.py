# Takes the files of docs/adding-a-sensor.md out of the page: each code block that follows a "file:"
# comment.
#   extract.py PAGE FOLDER
import pathlib
import re
import sys

page, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
files = re.findall(
    r"<!-- file: (\S+) -->\n```\w*\n(.*?)```\n", page.read_text(encoding="utf-8"), re.DOTALL
)
if len(files) != 3:
    sys.exit(f"{page}: {len(files)} files instead of three")
for name, text in files:
    path = folder / name
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
