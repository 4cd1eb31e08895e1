"""A workbench in a process of its own, for tests that talk to it."""

import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

COMMAND = (sys.executable, "-m", "fitting.cli", "workbench", "--no-browser")


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Served:
    """A workbench in a process of its own."""

    def __init__(self, *arguments):
        self.port = free_port()
        command = [*COMMAND, "--port", str(self.port), *arguments]
        env = {**os.environ, "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env)
        self.lines = []
        for line in self.process.stdout:
            self.lines.append(line)
            if "Ctrl+C" in line:
                break
        self.address = next(word for line in self.lines for word in line.split() if word.startswith("http://"))
        self.wait()

    def wait(self):
        for _ in range(600):
            try:
                return self.status(f"http://127.0.0.1:{self.port}/health")
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        raise AssertionError("the workbench does not answer")

    def status(self, address, **headers):
        try:
            with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=60) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, ""

    def end(self):
        self.process.terminate()
        self.process.wait(30)
