"""What is distributed: the wheel, its types, and the jar."""

import os
import subprocess
import sys
import zipfile

import pytest
from conftest import BUILD, SOURCE


def test_wheel(tmp_path):
    """Built from a copy, so that the checkout stays as it is; without the network."""
    import shutil

    shutil.copytree(SOURCE / "proto", tmp_path / "proto")
    shutil.copytree(SOURCE / "clients/python", tmp_path / "clients/python")
    shutil.copy(SOURCE / "VERSION", tmp_path)
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--quiet",
            "--no-deps",
            "--no-build-isolation",
            "--no-index",
            "-w",
            str(tmp_path),
            str(tmp_path / "clients/python"),
        ],
        check=True,
        timeout=600,
    )
    [wheel] = tmp_path.glob("*.whl")
    assert wheel.name.startswith("ruedo-") and wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        metadata = archive.read(next(n for n in names if n.endswith("METADATA"))).decode()
        archive.extractall(tmp_path / "installed")
    assert "ruedo/py.typed" in names
    for proto in (SOURCE / "proto").glob("*.lcm"):
        assert f"ruedo/lcmtypes/{proto.stem}.py" in names
    assert "Requires-Dist: lcm==1.5.3" in metadata and "Requires-Dist: numpy" in metadata
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "installed")}
    code = (
        "import ruedo; print(ruedo.__file__, f'{ruedo.lcmtypes.planar_lidar_t().get_hash():016x}')"
    )
    said = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert said.split() == [
        str(tmp_path / "installed/ruedo/__init__.py"),
        "e3d17423180b5e8d",
    ]  # bot_core's fingerprint


def test_jar_is_whole_and_for_java_11():
    jar = BUILD / "java/ruedo.jar"
    if not jar.exists():
        pytest.skip("no JDK here: there is no jar")
    with zipfile.ZipFile(jar) as archive:
        names = set(archive.namelist())
        assert {"ruedo/Ruedo.class", "ruedo/lcmtypes/world_info_t.class"} <= names
        # Of LCM it has the interface of messages alone, so that LCM's own jar may lie beside it on
        # the class path.
        others = {n for n in names if not n.startswith(("META-INF/", "ruedo/")) and n[-1] != "/"}
        assert others == {"lcm/lcm/LCMEncodable.class"}
        for name in names:
            if name.endswith(".class"):
                head = archive.read(name)[:8]
                assert int.from_bytes(head[6:8], "big") <= 55, name  # 55 is Java 11


def test_images_become_arrays():
    import numpy as np
    import ruedo

    def image(format, data, stride):
        return ruedo.Image(
            utime=0, width=2, height=2, format=format, row_stride=stride, data=bytes(data)
        )

    grey = image("gray", [1, 2, 99, 3, 4, 99], 3)  # one byte of padding behind each row
    assert grey.array().tolist() == [[1, 2], [3, 4]]
    bgr = image("bgr", range(12), 6)
    assert bgr.array().tolist() == [[[2, 1, 0], [5, 4, 3]], [[8, 7, 6], [11, 10, 9]]]
    depth = image("float32", np.array([1.5, np.inf, 0.25, 2.0], "<f4").tobytes(), 8)
    assert depth.array().tolist() == [[1.5, np.inf], [0.25, 2.0]]
    labels = image("gray16", [1, 0, 0, 1, 2, 0, 3, 0], 4)
    assert labels.array().tolist() == [[1, 256], [2, 3]]
    with pytest.raises(ValueError, match="more than 3 bytes"):
        image("gray", [1, 2, 3], 2).array()


def test_images_are_saved(tmp_path):
    import ruedo
    from PIL import Image

    jpeg = b"\xff\xd8\xffwhatever"
    ruedo.Image(0, 8, 8, "jpeg", 0, jpeg).save(tmp_path / "a.jpg")
    assert (tmp_path / "a.jpg").read_bytes() == jpeg
    ruedo.Image(0, 1, 2, "bgr", 3, bytes([1, 2, 3, 4, 5, 6])).save(tmp_path / "a.ppm")
    assert (tmp_path / "a.ppm").read_bytes() == b"P6 1 2 255\n" + bytes([3, 2, 1, 6, 5, 4])
    with pytest.raises(ValueError, match="array"):
        ruedo.Image(0, 1, 1, "float32", 4, bytes(4)).save(tmp_path / "depth")
    picture = ruedo.Image(0, 1, 2, "rgb", 3, bytes([1, 2, 3, 4, 5, 6]))
    picture.save(tmp_path / "a.PNG")
    assert [*Image.open(tmp_path / "a.PNG").getdata()] == [(1, 2, 3), (4, 5, 6)]
    with pytest.raises(ValueError, match="rgb pictures are saved as .png or .ppm, not as .jpg"):
        picture.save(tmp_path / "a.jpg")


def test_scan_nearest():
    import numpy as np
    import ruedo

    scan = ruedo.Scan(0, np.array([3.0, 1.0, 2.0]), np.array([-1.0, 0.0, 1.0]), np.array([]))
    assert (
        scan.nearest() == 1.0
        and scan.nearest(0.5, 1.0) == 2.0
        and scan.nearest(2.0, 3.0) == float("inf")
    )
