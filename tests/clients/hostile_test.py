"""Servers that lie or do not exist: each fault is reported clearly, and nothing breaks."""

import sys
import time

import pytest
from conftest import HERE, Server, free_url, probe


def fake(*options):
    url = free_url()
    server = Server([sys.executable, str(HERE / "fake_server.py"), url, *options], url)
    assert (
        server.process.stdout.readline() == "up\n"
    )  # a client waits 2 s, an interpreter may take longer to start
    return server


def test_no_server_is_said_within_two_seconds_with_the_url(language):
    url = free_url()
    start = time.monotonic()
    said = probe(language, url, "connect").one("failed")
    assert (
        time.monotonic() - start < 120.0
    )  # two seconds, and the start of the program on a busy machine
    assert (
        said.startswith("NoServer: ")
        and url in said
        and "within 2 s" in said
        and "ruedo doctor" in said
    )


@pytest.mark.parametrize("url", ["http://example.org", "nonsense", "udpm://239.255.76.67:notaport"])
def test_a_url_that_is_none_is_refused(language, url):
    assert probe(language, url, "connect").one("failed").startswith("NoServer: ")


def test_nothing_listens_on_a_tcp_port(language):
    said = probe(language, "tcpq://127.0.0.1:9", "connect").one("failed")
    assert said.startswith("NoServer: ") and "tcpq://127.0.0.1:9" in said and "ruedo doctor" in said


def test_a_server_of_another_version_is_named(language):
    with fake("--wrong-info") as server:
        said = probe(language, server.url, "connect").one("failed")
    assert said.startswith(
        "TypeMismatch: ruedo/info carries another version of world_info_t (fingerprint 0000000000000000)"
    )


def test_a_channel_of_another_version_and_a_silent_one(language):
    with fake("--wrong-type") as server:
        said = probe(language, server.url, "streams", "p3at", "0.6")
    lrf, odometry = said.one("lrf"), said.one("odometry")
    assert (
        lrf.startswith("TypeMismatch: p3at/LRF carries another version of planar_lidar_t")
        and "9.9.9" in lrf
    )
    assert "e3d17423180b5e8d" in lrf  # bot_core's fingerprint, which this client reads
    assert (
        odometry.startswith("Timeout: no sample on p3at/odometry within 0.6 s")
        and "50 Hz" in odometry
    )


def test_good_samples_come_through(language):
    with fake() as server:
        assert probe(language, server.url, "streams", "p3at", "1").one("lrf") == "none"


def test_a_pause_is_named_as_the_reason_of_silence(language):
    with fake("--paused") as server:
        assert "paused" in probe(language, server.url, "streams", "p3at", "0.3").one("odometry")


def test_broken_messages_are_errors_and_no_crash(language):
    with fake("--garbage") as server:
        said = probe(language, server.url, "streams", "p3at", "2")
    assert said.one("lrf").startswith("TypeMismatch: p3at/LRF")
    assert said.one("odometry").startswith("Timeout: ")


def test_a_request_that_the_server_does_not_have(language):
    with fake() as server:
        said = probe(language, server.url, "quit").one("failed")
    assert said.startswith("NotSupported: this server (Ruedo 9.9.9) has no QUIT request")
