"""What is no address is refused at once, with the same words, by the server and by the clients in
each language.
"""

import os
import subprocess

import pytest
from conftest import ARENA, PROBES, RUEDO

OPTIONS = "ttl, 0 to 255, and recv_buf_size, 1 to 2147483647 bytes, are, each once"
GROUPS = "is not a multicast group (224.0.0.0 to 239.255.255.255)"
WRONG = {
    "arena": "it has no scheme",
    "udpm:/239.255.76.67": "it has no scheme",
    "http://127.0.0.1:80": "the schemes udpm, tcpq",
    "UDPM://239.255.76.67:7667": "the schemes udpm, tcpq",
    "unix://bus.sock": "'bus.sock' is not an absolute path",
    "udpm://127.0.0.1:7667": f"'127.0.0.1' {GROUPS}",
    "udpm://239.255.76:7667": f"'239.255.76' {GROUPS}",
    "udpm://[ff02::1]:7667": "is no",
    "udpm://239.255.76.67:0": "'0' is not a port",
    "udpm://239.255.76.67:7667/": "'7667/' is not a port",
    "tcpq://127.0.0.1:65536": "'65536' is not a port",
    "tcpq://[::1]:7700": "LCM has no IPv6: '[::1]:7700' is not allowed; give a name or an IPv4",
    "tcpq://no.such.host.invalid:7700": "'no.such.host.invalid' is not a host that this machine knows",
    "tcpq://127.0.0.1:7700?ttl=1": "tcpq has no options",
    "udpm://239.255.76.67:7667?ttl=256": f"the option 'ttl=256' is not allowed: {OPTIONS}",
    "udpm://239.255.76.67:7667?ttl=O": f"the option 'ttl=O' is not allowed: {OPTIONS}",
    "udpm://239.255.76.67:7667?TTL=1": f"the option 'TTL=1' is not allowed: {OPTIONS}",
    "udpm://239.255.76.67:7667?ttl=0&ttl=1": f"the option 'ttl=1' is not allowed: {OPTIONS}",
    "udpm://239.255.76.67:7667?recv_buf_size=2MB": f"the option 'recv_buf_size=2MB' is not allowed: {OPTIONS}",
}


def said(command, **environment):
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    return done.returncode, (done.stdout + done.stderr).strip()


@pytest.mark.parametrize("url", WRONG)
def test_the_server_refuses(url):
    for code, text in (
        said([RUEDO, "run", ARENA, "--quiet", "--lcm", url]),
        said([RUEDO, "run", ARENA, "--quiet"], LCM_DEFAULT_URL=url),
    ):
        assert code == 2 and "\n" not in text, text
        assert f" '{url}': " in text and WRONG[url] in text and "an address looks like" in text
    assert text.startswith("ruedo: LCM_DEFAULT_URL '")


@pytest.mark.parametrize("url", WRONG)
def test_clients_refuse(language, url):
    _, text = said([*PROBES[language], url, "connect"])
    assert text.startswith("failed NoServer: ") and "\n" not in text, text
    assert f"url '{url}': " in text and WRONG[url] in text and "an address looks like" in text


def test_a_servers_own_address_is_refused(language):
    _, text = said([*PROBES[language], "memq://", "connect"])
    assert text.startswith("failed NoServer: url 'memq://': "), text
