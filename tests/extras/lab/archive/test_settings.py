"""What an administrator may write into `[archive]`, and what of it is never shown."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from daq.config.settings import load_settings
from daq.contracts.errors import SpecError
from extras.lab.archive.bucket import load_credentials, object_name
from extras.lab.archive.settings import ArchiveSettings
from tests.extras.lab.archive.store import ACCESS, SECRET


def _config(folder: Path, *lines: str) -> Path:
    path = folder / "daq.toml"
    path.write_text("\n".join(("[archive]", *lines, "")), "utf-8")
    return path


def test_the_guides_configuration_can_be_said_and_says_everything(tmp_path: Path) -> None:
    guide = Path(__file__).parents[4].joinpath("docs", "archive.md").read_text("utf-8")
    (block,) = (
        text for text in re.findall(r"^```toml\n(.*?)^```", guide, re.MULTILINE | re.DOTALL) if "[archive]" in text
    )
    path = tmp_path / "daq.toml"
    path.write_text(block, "utf-8")
    found = load_settings(path)[0].section(ArchiveSettings)
    assert found.model_fields_set == set(ArchiveSettings.model_fields)
    assert found.place == "arm-traces at https://s3.lab:9000"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('bucket = "UP"', "is not the name of a bucket; write 3 to 63 lower-case letters"),
        *(
            (line, f"archive.{line.partition(' ')[0]}")
            for line in (
                'bucket = "ab"',
                'bucket = "../etc"',
                'endpoint = "file:///etc/passwd"',
                'endpoint = "s3.lab:9000"',
                'endpoint = "http://host:port"',
                f'endpoint = "http://anna:{SECRET}@s3.lab"',
                f'endpoint = "https://s3.lab/?token={SECRET}"',
                f'secret_key = "{SECRET}"',
                f'access_key = "{SECRET}"',
                'prefix = "../other"',
                "keep_days = -1",
                "timeout = 0",
            )
        ),
    ],
)
def test_a_wrong_setting_is_one_line_without_secrets(tmp_path: Path, line: str, words: str) -> None:
    with pytest.raises(SpecError, match=words) as caught:
        load_settings(_config(tmp_path, line))
    assert SECRET not in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "pattern" not in str(caught.value) or line.startswith("prefix")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f'access_key = "{ACCESS}"', "secret_key: allowed are"),
        (f'access_key = "{ACCESS}"\nsecret_key = 7', "secret_key: allowed are"),
        (f'access_key = "{ACCESS}"\nsecret_key = "{SECRET}"\nother = "{SECRET}"', "other: allowed are"),
        (f'access_key = "{ACCESS}"\nsecret_key = {SECRET}', "is not TOML"),
        (f'access_key = "{ACCESS}"\nsecret_key = ""', "is empty"),
        (None, "cannot be read"),
    ],
)
def test_a_wrong_file_of_credentials_is_one_line_without_them(tmp_path: Path, text: str | None, words: str) -> None:
    file = tmp_path / "store.toml"
    if text is not None:
        file.write_text(text, "utf-8")
    with pytest.raises(SpecError, match=words) as caught:
        load_credentials(ArchiveSettings(bucket="traces", credentials=file))
    assert SECRET not in str(caught.value)
    assert ACCESS not in str(caught.value)


def test_credentials_of_a_file_and_of_the_environment_are_the_same_and_hidden(tmp_path: Path) -> None:
    file = tmp_path / "store.toml"
    file.write_text(f'access_key = "{ACCESS}"\nsecret_key = "{SECRET}"\n', "utf-8")
    of_file = load_credentials(ArchiveSettings(bucket="traces", credentials=file))
    there = {"AWS_ACCESS_KEY_ID": ACCESS, "AWS_SECRET_ACCESS_KEY": SECRET}
    assert load_credentials(ArchiveSettings(bucket="traces"), there) == of_file
    assert of_file.secret_key.get_secret_value() == SECRET
    assert SECRET not in repr(of_file)


def test_names_of_objects_need_no_escape_and_tell_contents_apart() -> None:
    from datetime import UTC, datetime

    at = datetime(2026, 3, 2, tzinfo=UTC)
    one, other = (object_name("lab/a", "ma2000", "../größer #1?.mcap", at, digest * 64) for digest in "ab")
    assert one == "lab/a/ma2000/2026/gr_er_1-aaaaaaaaaaaaaaaa.mcap"
    assert other != one
    assert object_name("", "ma2000", "….mcap", at, "a" * 64) == "ma2000/2026/trace-aaaaaaaaaaaaaaaa.mcap"


def test_without_obstore_one_line_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['obstore'] = None\n"
        "import importlib.util as u; was = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'obstore' else was(name, *rest)\n"
        "from extras.lab.archive.settings import ArchiveSettings\n"
        "from extras.lab.archive.bucket import open_bucket\n"
        "try: open_bucket(ArchiveSettings(bucket='traces'))\n"
        "except Exception as error: print(error)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ended.stdout == (
        "archive.bucket traces: obstore is not installed: `pip install 'ma2000-daq[archive]'` in daq's environment\n"
    )
