"""make_sbom.py WHEEL OUT: what is inside of Ruedo's wheel, as SPDX 2.3 in JSON: each package that a
file of it came from, with its version.
"""

import hashlib
import json
import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path


def version_of(name: str) -> str:
    """Of a Debian package that a licence is named by."""
    return subprocess.run(
        ["dpkg-query", "-W", "-f=${Version}", name], capture_output=True, text=True
    ).stdout


def main(wheel: Path, out: Path) -> None:
    version = wheel.name.split("-")[1]
    with zipfile.ZipFile(wheel) as archive:
        licences = sorted(
            {Path(name).name for name in archive.namelist() if ".dist-info/licenses/" in name}
        )
    inside = {
        name: version_of("musl-dev" if name == "musl" else name)
        for name in licences
        if not name.startswith("lcm-")
    }
    inside["lcm"] = "1.5.3"
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    packages = [
        {
            "SPDXID": "SPDXRef-ruedo",
            "name": "ruedo",
            "versionInfo": version,
            "licenseConcluded": "BSD-3-Clause",
            "downloadLocation": "NOASSERTION",
            "packageFileName": wheel.name,
            "checksums": [{"algorithm": "SHA256", "checksumValue": digest}],
        }
    ]
    packages += [
        {
            "SPDXID": f"SPDXRef-{name}",
            "name": name,
            "versionInfo": inside[name],
            "licenseConcluded": "NOASSERTION",
            "licenseComments": f"licenses/{name} in the wheel's metadata",
            "downloadLocation": "NOASSERTION",
        }
        for name in sorted(inside)
    ]
    created = time.strftime(
        "%Y-%m-%dT%H:%M:%SZ", time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", "0")))
    )
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": wheel.name,
        "documentNamespace": f"urn:ruedo:{version}:{digest}",
        "creationInfo": {"created": created, "creators": ["Tool: make_sbom.py"]},
        "packages": packages,
        "relationships": [
            {
                "spdxElementId": "SPDXRef-DOCUMENT",
                "relationshipType": "DESCRIBES",
                "relatedSpdxElement": "SPDXRef-ruedo",
            }
        ]
        + [
            {
                "spdxElementId": "SPDXRef-ruedo",
                "relationshipType": "CONTAINS",
                "relatedSpdxElement": f"SPDXRef-{name}",
            }
            for name in sorted(inside)
        ],
    }
    out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
