"""How a worker says how far its job is."""

from pathlib import Path

from server.jobs.mailbox import Mailbox, Reported


def _told(mailbox: Mailbox) -> tuple[float, str] | None:
    reported: Reported | None = mailbox.reported()
    return None if reported is None else (reported.fraction, reported.text)


def test_the_beginning_of_something_long_is_told_however_soon_it_comes(tmp_path: Path) -> None:
    mailbox = Mailbox(tmp_path)
    mailbox.tell(0.5, "comparing")
    mailbox.tell(0.9, "compared")
    assert _told(mailbox) == (0.5, "comparing")
    mailbox.tell(0.94, "locating", at_once=True)
    assert _told(mailbox) == (0.94, "locating")
