"""make_sbom.py BUILD OUT FILE...: what the files of a release are and what is inside of
them, as SPDX 2.3 in JSON: each package that something of it came from, with its version.
"""

import hashlib
import importlib.metadata
import json
import os
import re
import sys
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "packaging"))

import parts  # noqa: E402

Part = tuple[str, str, str, str]  # name, version, licence, what registries call it


def shared(wheels: list[Path]) -> list[Part]:
    """Of the wheels' shared libraries, which are named by the licences there."""
    inside = [Path(name) for wheel in wheels for name in zipfile.ZipFile(wheel).namelist()]
    licences = [path for path in inside if path.parent.parts[-2:] == ("licenses", "debian")]
    names = sorted({path.name for path in licences})
    versions = [parts.installed()[name][1] for name in names]
    return [
        (name, version, parts.licence_of(name), f"pkg:deb/debian/{name}@{version}")
        for name, version in zip(names, versions, strict=True)
    ]


def inside(build: Path, wheels: list[Path]) -> list[Part]:
    """Shared libraries; what is compiled in; of what Python and npm gave."""
    found = shared(wheels)
    for source, (_, _, licence) in parts.COMPILED.items():
        if names := parts.packages_of(source):
            version = parts.installed()[names[0]][1]
            locator = f"pkg:deb/debian/{source}@{version}?arch=source"
            found.append((f"{source} (source)", version, licence, locator))
    for name, (_, _, licence) in parts.COMPILED_PYPI.items():
        version = importlib.metadata.version(name)
        found.append((name, version, licence, f"pkg:pypi/{name}@{version}"))
    if any(wheel.name.startswith("ruedo_docs-") for wheel in wheels):
        for name, licence in parts.SITE.items():
            version = importlib.metadata.version(name)
            found.append((name, version, licence, f"pkg:pypi/{name}@{version}"))
    for _, name, version, licence in parts.of_npm(build):
        found.append((name, version, licence, f"pkg:npm/{name}@{version}"))
    return found


def identifier(name: str) -> str:
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def package_of_file(file: Path, version: str) -> dict[str, object]:
    return {
        "SPDXID": identifier(file.name),
        "name": file.name,
        "versionInfo": version,
        "licenseConcluded": "BSD-3-Clause",
        "licenseDeclared": "BSD-3-Clause",
        "copyrightText": "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "packageFileName": file.name,
        "checksums": [
            {
                "algorithm": "SHA256",
                "checksumValue": hashlib.sha256(file.read_bytes()).hexdigest(),
            }
        ],
    }


def package_inside(name: str, version: str, licence: str, locator: str) -> dict[str, object]:
    return {
        "SPDXID": identifier(name),
        "name": name,
        "versionInfo": version,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "comment": "its licence is in share/doc/ruedo/copyright, or in licenses/debian of the wheel",
        "externalRefs": [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": locator,
            }
        ],
    }


def main(build: Path, out: Path, files: list[Path]) -> None:
    version = (ROOT / "VERSION").read_text(encoding="utf-8").strip()
    wheels = [file for file in files if file.suffix == ".whl"]
    made = [package_of_file(file, version) for file in files]
    found = [package_inside(*one) for one in inside(build, wheels)]

    def related(one: str, kind: str, other: str) -> dict[str, str]:
        return {"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}

    relationships = [related("SPDXRef-DOCUMENT", "DESCRIBES", str(one["SPDXID"])) for one in made]
    relationships += [
        related(identifier(files[0].name), "CONTAINS", str(one["SPDXID"])) for one in found
    ]
    digest = hashlib.sha256("".join(str(one["checksums"]) for one in made).encode()).hexdigest()
    created = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", "0")))
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"ruedo-{version}",
        "documentNamespace": f"urn:ruedo:{version}:{digest}",
        "creationInfo": {
            "created": time.strftime("%Y-%m-%dT%H:%M:%SZ", created),
            "creators": ["Tool: make_sbom.py"],
        },
        "packages": made + found,
        "relationships": relationships,
    }
    out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    build, out, *files = (Path(word) for word in sys.argv[1:])
    main(build, out, files)
