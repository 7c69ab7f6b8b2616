"""What Prometheus is told, as its own parser reads it."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from daq.contracts.service.jobs import CompareRequest, Job
from extras.lab.prometheus.part import Counts
from tests.server.service import Service

NOON = datetime(2026, 3, 2, 12, 0, tzinfo=UTC)


class Scraped:
    def __init__(self, text: str) -> None:
        self.families = {family.name: family for family in text_string_to_metric_families(text)}

    def value(self, name: str, labels: Mapping[str, str]) -> float:
        """Of one sample; 0 where there is none."""
        found = [
            sample.value
            for family in self.families.values()
            for sample in family.samples
            if sample.name == name and labels.items() <= sample.labels.items()
        ]
        assert len(found) <= 1, found
        return found[0] if found else 0.0


def _scraped(service: Service) -> Scraped:
    answer = service.client.get(f"{service.url}/metrics")
    assert answer.status_code == 200, answer.text
    return Scraped(answer.text)


def _job(state: Any, **more: Any) -> Job:
    request = CompareRequest(traces=("a",), models=("machine",))
    return Job(id="a", robot="ma2000", request=request, state=state, submitted=NOON, submitted_by="anna", **more)


def test_stops_refused_tokens_and_outcomes_are_counted(service: Service) -> None:
    service.until_connected()
    robot = {"robot": "ma2000"}
    spec = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}
    before = _scraped(service)
    done = service.end_of(service.robot.post("/experiments", json={"spec": spec}).json()["id"])
    assert done["state"] == "done"
    refused = service.client.get("/me", headers={"Authorization": "Bearer nobody-knows-this"})
    assert refused.status_code == 401
    assert service.robot.post("/stop").json()["confirmed"]
    service.until_arm("stopped")
    while _scraped(service).value("daq_stops_total", robot) == before.value("daq_stops_total", robot):
        assert service.process.poll() is None  # it is counted once it has been answered
    after = _scraped(service)

    def grown(name: str, labels: Mapping[str, str]) -> float:
        return after.value(name, labels) - before.value(name, labels)

    assert grown("daq_stops_total", robot) == 1
    assert grown("daq_refused_requests_total", {"reason": "token-unknown"}) == 1
    assert grown("daq_experiments_total", {**robot, "state": "done"}) == 1
    assert after.value("daq_stopped", robot) == 1
    assert after.value("daq_connected", robot) == 1
    assert after.value("daq_disk_free_bytes", {"folder": "traces"}) > after.value("daq_disk_reserve_bytes", {}) > 0


def test_a_job_is_counted_once_when_it_has_ended() -> None:
    metrics = Counts()
    begun = {"started": NOON}
    for job in (_job("queued"), _job("running", **begun), _job("running", **begun)):
        metrics.count_job(job)
    metrics.count_job(_job("done", started=NOON, ended=NOON + timedelta(seconds=4)))
    metrics.count_job(_job("cancelled", ended=NOON))
    found = Scraped(generate_latest(metrics.registry).decode())
    labels = {"robot": "ma2000", "kind": "compare"}
    assert found.value("daq_jobs_total", {**labels, "state": "done"}) == 1
    assert found.value("daq_jobs_total", {**labels, "state": "cancelled"}) == 1
    assert found.value("daq_job_seconds_count", labels) == 1
    assert found.value("daq_job_seconds_sum", labels) == 4.0
