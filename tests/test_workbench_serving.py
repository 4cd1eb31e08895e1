"""The workbench at work: jobs that can be called off, and a server that listens to its own page alone."""

import socket
import subprocess
import threading
import time

import pytest
from served import COMMAND, Served

from fitting.errors import InputError
from fitting.workbench.job import Job
from fitting.workbench.serving import is_loopback, is_own, listening


def test_work_that_is_called_off_leaves_no_result():
    going, ended = threading.Event(), []

    def work(tell):
        for k in range(1000):
            tell("working", k / 1000)
            going.set()
            time.sleep(0.01)
        ended.append(True)

    job = Job("working", work)
    assert going.wait(10)
    assert 0 <= job.share < 1
    job.cancel()
    assert job.done
    assert job.wait(10).result is None
    assert not ended
    assert "Called off" in job.problem


def test_bad_input_ends_work_with_its_message():
    def work(tell):
        raise InputError("the file is empty", "x.csv", cure="begin with a header")

    assert Job("reading", work).wait(10).problem == "x.csv: the file is empty. Cure: begin with a header"


@pytest.mark.parametrize(
    ("headers", "own"),
    [
        ({b"host": b"127.0.0.1:8642"}, True),
        ({b"host": b"127.0.0.1:8642", b"origin": b"http://127.0.0.1:8642"}, True),
        ({b"host": b"127.0.0.1:8642", b"origin": b"https://elsewhere.example"}, False),
        ({b"host": b"rebound.example"}, False),
        ({}, False),
    ],
)
def test_only_its_own_page_may_talk_to_the_workbench(headers, own):
    assert is_own(headers, ("127.0.0.1", "localhost")) is own


@pytest.mark.parametrize(
    ("host", "here"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("lab.example", False)],
)
def test_a_host_that_others_reach_is_known(host, here):
    assert is_loopback(host) is here


def test_it_listens_to_this_machine_alone():
    with listening("127.0.0.1", None) as one:
        assert one.getsockname()[0] == "127.0.0.1"


@pytest.fixture
def serve():
    """Workbenches that end with the test."""
    pytest.importorskip("marimo")
    running = []

    def begin(*arguments):
        running.append(Served(*arguments))
        return running[-1]

    yield begin
    for one in running:
        one.end()


def test_it_listens_here_alone_unless_told_otherwise_and_then_asks_for_a_token(serve):
    here, elsewhere = serve(), serve("--host", "0.0.0.0", "--token", "s3cret")
    status, text = here.status(here.address)
    assert status == 200
    assert "McKibben" in text or "mckibben" in text
    assert here.status(here.address, Host="rebound.example")[0] == 403
    assert "access_token=s3cret" in elsewhere.address
    place = f"http://127.0.0.1:{elsewhere.port}/"
    assert "marimo-filename" not in elsewhere.status(place)[1]
    assert elsewhere.status(f"http://127.0.0.1:{elsewhere.port}/api/kernel/run")[0] in (401, 403, 405)


def test_a_port_in_use_and_a_data_set_that_is_not_there_are_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        for arguments, words in ((["--port", str(taken.getsockname()[1])], "cannot be listened at"),
                                 (["no_such_data"], "no such file or folder")):  # fmt: skip
            ended = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=120)
            assert ended.returncode == 2
            assert words in ended.stderr
            assert "Cure:" in ended.stderr
