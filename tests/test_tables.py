"""What loggers and spreadsheets write: encodings, line ends, separators, decimal commas, comments."""

import pytest
from folders import folder_of, loop_columns, loop_csv, only_run

from fitting.errors import InputError
from fitting.recordings import read_experiment

pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: ("\ufeff" + text).encode(),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.replace(",", ";").encode(),
        lambda text: text.replace(",", "\t").encode(),
        lambda text: text.replace(",", ";").replace(".", ",").encode(),
        lambda text: text.replace(",", "\t").replace(".", ",").encode(),
        lambda text: text.replace(",", ", ").encode(),
        lambda text: text.replace("\n", ",\n").encode(),
        lambda text: text.rstrip("\n").encode(),
    ],
    ids=["BOM", "UTF-16", "CRLF", "CR", "semicolons", "tabs", "decimal commas", "tabs, decimal commas", "spaces",
         "trailing commas", "no last newline"],
)  # fmt: skip
def test_what_loggers_and_spreadsheets_write_is_read(tmp_path, change):
    _, run = only_run(folder_of(tmp_path, change(loop_csv())))
    assert run.measured == pytest.approx(loop_columns()["force [N]"])
    assert run.row[-1] == 203


def test_comments_and_blank_lines_do_not_shift_the_rows(tmp_path):
    lines = loop_csv().splitlines()
    lines[50] = lines[50].replace(",2.0,", ",two,")
    text = "\n".join(["# made by hand", "", lines[0], "# begins", *lines[1:]])
    with pytest.raises(InputError) as caught:
        read_experiment(folder_of(tmp_path, text))
    assert caught.value.row == text.splitlines().index(next(line for line in text.splitlines() if "two" in line)) + 1
