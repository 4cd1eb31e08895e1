"""The command line, typed: what it says, and the one message when it refuses; folders that it may write into."""

from pathlib import Path

from click.testing import CliRunner

from fitting.cli.main import main


def copied(source: Path, folder: Path) -> Path:
    """A copy of a data set without its model."""
    folder.mkdir()
    for file in source.iterdir():
        if file.name != "model.toml":
            (folder / file.name).write_bytes(file.read_bytes())
    return folder


def run(*args, status=0):
    """The result of a command that ends with this status."""
    result = CliRunner().invoke(main, [str(arg) for arg in args])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == status, result.output
    return result


def refused(*args):
    """The one message of a refused command."""
    message = run(*args, status=2).stderr
    assert message.startswith("mckibben: ")
    assert "Traceback" not in message
    assert message.count("\n") == 1
    return message
