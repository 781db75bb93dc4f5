"""The test vectors, in each language: messages and what they mean, and scripted conversations with
loss and reordering. The runners have a transport of their own, on standard input and output:
nothing is lost but what the script loses."""

import json
import os
import struct
import subprocess
import sys
import threading
import zlib

import pytest
from conftest import BUILD, HERE, PATIENCE
from witness import attempts

RUNNERS = {"python": [sys.executable, str(HERE / "vectors/runner.py")]}
if "RUEDO_VECTORS_CPP" in os.environ:
    RUNNERS["cpp"] = [os.environ["RUEDO_VECTORS_CPP"]]
if "RUEDO_PROBE_JAVA" in os.environ:
    RUNNERS["java"] = [
        "java",
        "-cp",
        f"{BUILD}/java/ruedo.jar:{os.environ['RUEDO_PROBE_JAVA']}",
        "ruedo.VectorsRunner",
    ]
CONVERSATIONS = {
    name: one
    for name, one in json.loads((HERE / "vectors/conversations.json").read_text()).items()
    if name != "about"
}


def messages():
    """[(line, its meaning)]"""
    cases = []
    for line in (HERE / "vectors/messages.txt").read_text().splitlines():
        if line.startswith("  "):
            cases[-1][1].append(line[2:])
        elif not line.startswith("#"):
            cases.append((line, []))
    return cases


@pytest.mark.parametrize("runner", list(RUNNERS))
def test_messages(runner):
    cases = messages()
    given = "".join(line + "\n" for line, _ in cases)
    done = subprocess.run(
        [*RUNNERS[runner], "decode"], input=given, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr
    said = [one.split("\n") for one in done.stdout.split("\n.\n")[:-1]]
    assert len(said) == len(cases) > 50
    wrong = [(line, meaning, one) for (line, meaning), one in zip(cases, said) if meaning != one]
    assert not wrong


class Script:
    """A server that says what a conversation has it say."""

    RUN, EPOCH = 7, 0
    TICK, ODOMETRY = 0, 1  # channels

    def __init__(self, client):
        from ruedo import lcmtypes

        self.types, self.client = lcmtypes, client
        self.granted = 0  # sequence of the client's newest grant
        self.joined = 0  # times, since the last request that was awaited
        self.last = None  # of its requests that were awaited

    def odometry(self, state):
        message = self.types.odometry_t()
        message.utime, message.x = 5000 * state, float(state)
        return message.encode()

    def tick(self, state, applied=False, of=""):
        message = self.types.tick_t()
        message.utime, message.run_id, message.epoch, message.step, message.state_hash = (
            5000 * state,
            self.RUN,
            self.EPOCH,
            state,
            100 + state,
        )
        message.nparts = 1
        message.run_id += of == "another run"
        message.epoch += of == "the next epoch"
        if applied:
            one = self.types.tick_applied_t()
            one.client, one.sequence = "test", self.granted
            message.applied, message.napplied = [one], 1
        entry = self.types.tick_message_t()
        data = self.odometry(state)
        entry.channel_index, entry.sequence, entry.size = self.ODOMETRY, state, len(data)
        entry.crc = struct.unpack(">i", struct.pack(">I", zlib.crc32(data)))[0]
        message.manifest, message.nmanifest = [entry], 1
        return message.encode()

    def send(self, channel, data):
        self.client.stdin.write(
            struct.pack(">ii", len(channel), len(data)) + channel.encode() + data
        )
        self.client.stdin.flush()

    def reply(self, request, body=b"", code=0, text=""):
        message = self.types.reply_t()
        message.run_id, message.epoch, message.session, message.sequence, message.kind = (
            self.RUN,
            self.EPOCH,
            5,
            request.sequence,
            request.kind,
        )
        message.code, message.text, message.size, message.body = code, text, len(body), body
        self.send("ruedo/reply", message.encode())

    def info(self):
        message = self.types.world_info_t()
        message.run_id, message.nparts, message.version, message.world, message.step_us = (
            self.RUN,
            1,
            "1",
            "script",
            5000,
        )
        kinds = self.types.request_t
        message.features = 1 << 1 | 1 << kinds.PAUSE | 1 << kinds.GRANT | 1 << kinds.RESEND
        robot = self.types.robot_info_t()
        robot.name, robot.drive = "p3at", "kinematic"
        message.robots, message.nrobots = [robot], 1
        for name, owner, device, type, input in (
            ("ruedo/tick", "", "", "tick_t", False),
            ("p3at/odometry", "p3at", "odometry", "odometry_t", False),
            ("p3at/velocity", "p3at", "velocity", "velocity_command_t", True),
        ):
            channel = self.types.channel_info_t()
            channel.name, channel.robot, channel.device, channel.type, channel.input = (
                name,
                owner,
                device,
                type,
                input,
            )
            channel.fingerprint = struct.unpack(
                ">q", getattr(self.types, type)._get_packed_fingerprint()
            )[0]
            message.channels.append(channel)
        message.nchannels = len(message.channels)
        self.send("ruedo/info", message.encode())

    def read(self, size):
        data = self.client.stdout.read(size)
        assert len(data) == size, "the client has ended"
        return data

    def request(self):
        """The next that the conversation is about; joining and asking what there is is answered
        here.
        """
        while True:
            name, size = struct.unpack(">ii", self.read(8))
            channel, data = self.read(name).decode(), self.read(size)
            assert channel == "ruedo/request"
            request = self.types.request_t.decode(data)
            if request.kind == request.INFO:
                self.info()
            elif request.kind == request.JOIN:
                self.joined += 1
                self.reply(request)
            elif (
                request.kind == request.GRANT
                and self.types.grant_request_t.decode(request.body).granted < 0
            ):  # takes part
                body = self.types.grant_reply_t()
                body.granted, body.received, body.step = 0, -1, 0
                self.reply(request, body.encode())
                return None
            else:
                return request

    def client_says(self, kind, wants=None, again=False):
        while True:
            request = self.request()
            if request is None or request.kind != getattr(self.types.request_t, kind):
                continue
            if kind == "GRANT":
                if (request.sequence == self.granted) != again:
                    continue
                self.granted = request.sequence
            elif kind == "PAUSE":
                if not self.joined:  # repeated
                    continue
                self.joined = 0
            else:
                wanted = [
                    [w.step, "tick" if w.channel_index == self.TICK else w.offset]
                    for w in self.types.resend_request_t.decode(request.body).wanted
                ]
                if wanted != wants:  # of before the last that came
                    continue
            self.last = request
            return

    def pieces(self, pieces, spoilt=False):
        body = self.types.resend_reply_t()
        body.step = max(piece[0] for piece in pieces)
        for state, offset, *size in pieces:
            part = self.types.resend_part_t()
            data = self.tick(state) if offset == "tick" else self.odometry(state)
            part.step, part.total, part.offset = state, len(data), 0 if offset == "tick" else offset
            part.channel_index, part.sequence = (
                (self.TICK, 0) if offset == "tick" else (self.ODOMETRY, state)
            )
            part.data = data[part.offset : part.offset + size[0]] if size else data
            if spoilt:
                part.data = bytes(len(part.data))
            part.size = len(part.data)
            body.parts.append(part)
        body.nparts = len(body.parts)
        self.reply(self.last, body.encode())

    def say(self, line):
        if "client" in line:
            self.client_says(line["client"], line.get("wants"))
        elif "again" in line:
            self.client_says(line["again"], again=True)
        elif "tick" in line:
            self.send(
                "ruedo/tick",
                self.tick(line["tick"], line.get("applied", False), line.get("of", "")),
            )
        elif "message" in line:
            self.send("p3at/odometry", self.odometry(line["message"]))
        elif "pieces" in line:
            self.pieces(line["pieces"], line.get("spoilt", False))
        elif "refuse" in line:
            self.reply(
                self.last, code=getattr(self.types.reply_t, line["refuse"]), text=line["text"]
            )
        else:
            whole = self.tick(1, True)
            for end in (7, 30, len(whole) - 1):
                self.send("ruedo/tick" if line["broken"] == "tick" else "ruedo/reply", whole[:end])


def converse(runner, one, patience):
    """The script, what the client said, and what went wrong."""
    command = [*RUNNERS[runner], "converse", *map(str, one["steps"])]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as client:
        killer = threading.Timer(patience, client.kill)
        killer.start()
        script, said, wrong = Script(client), [], None
        try:
            while "pause" not in one["steps"] and script.request() is not None:
                pass  # until it takes part
            for line in one["say"]:
                script.say(line)
            said = client.stderr.read().decode().splitlines()
        except (AssertionError, BrokenPipeError) as error:
            wrong = error
        finally:
            killer.cancel()
            client.kill()
        return script, said, wrong


@pytest.mark.parametrize("name", list(CONVERSATIONS))
@pytest.mark.parametrize("runner", list(RUNNERS))
def test_conversations(runner, name):
    """A client that has heard nothing for 1.7 s doubts all that it has of the steps to come, and
    asks for more than a script knows of.
    """
    one = CONVERSATIONS[name]
    for witness in attempts():
        script, said, wrong = converse(runner, one, PATIENCE)
        if not wrong or not witness.excuses():
            break
    if wrong:
        raise wrong
    expected = []
    for states in one["sees"]:
        last = states[-1]
        seen = [f"{state}:p3at/odometry:{zlib.crc32(script.odometry(state))}" for state in states]
        expected.append(" ".join(["step", str(last), str(5000 * last), str(100 + last), *seen]))
    assert said == expected + ([one["ends"]] if "ends" in one else [])
