"""docs/observability.md agrees with the code."""

import json
import logging
import re

from service.server.logs import RecordFormatter
from service.settings.values import Settings
from tests.api.observing.test_middleware import send_request
from tests.server.test_logs import build_error_record
from tools.processes import ROOT

TEXT = (ROOT / "docs" / "observability.md").read_text(encoding="utf-8")


def test_the_table_lists_all_fields_of_the_log() -> None:
    section = TEXT.partition("## The log")[2].partition("## Health")[0]
    cells = re.findall(r"^\| (`.*?) \| (\w+) \|", section, re.MULTILINE)
    fields_on_page = {name for names, _ in cells for name in re.findall(r"`(\w+)`", names)}
    # The log has one line for this request without headers. For the path /refused it has a code of
    # an error.
    _, (line,), _ = send_request([], Settings(log_format="json"), path="/refused")
    error_record = json.loads(RecordFormatter("json").format(build_error_record()))
    # The request above is not for a surface, so its line lacks these three fields.
    fields_of_log = json.loads(line).keys() | error_record.keys() | {"surface", "format", "cache"}
    assert fields_on_page == fields_of_log
    # The section also names the highest level, which neither of these records has.
    assert logging.getLevelName(logging.CRITICAL).lower() in section
