"""The report of a diagnosis: one file with its program and its data, which opens without service and network.

The program is what the dashboard tells a diagnosis with (`server/dashboard/src/report`); the build makes it one file.
"""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from pydantic import TypeAdapter

from daq.contracts.errors import SpecError
from model.discrepancy.explanation.answer_words import headline
from model.reports.page import section_html

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from model.blocks import Section
    from model.discrepancy.diagnosis import Diagnosis

PLACE = '<script id="data" type="application/json">{}</script>'
"""Where the program reads its data."""


def saved_report(data: Diagnosis, names: Mapping[str, str], sections: Iterable[Section] = ()) -> str:
    """Returns the file as text.

    Args:
        data: the answer with its data for plots, `DiagnosisData`.
        names: names of the traces by ID, if known.
        sections: of plug-ins (`daq.plugins.report_sections`).

    Raises SpecError if the page is not built, which only a source tree can lack.
    """
    program = files("server").joinpath("dashboard", "dist", "report.html")
    if not program.is_file():
        raise SpecError("the report needs the dashboard's page, which is not built: run `make page`")
    saved = {
        "headline": headline(data),
        "found": data.model_dump(mode="json"),
        "names": dict(names),
        "sections": [section_html(section) for section in sections],
    }
    text = TypeAdapter(dict).dump_json(saved).decode()
    # no text of the data can end the element
    return program.read_text("utf-8").replace(PLACE, PLACE.replace("{}", text.replace("<", "\\u003c")))
