"""One example of every kind of problem, and the operations that may answer with it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from daq.contracts.service.problems import FieldProblem, ProblemDetails
from server.problems import ProblemError, details_of

CHANGES = "(post|put|patch|delete) "
NOWHERE = r"(?!)"
MOVES = f"{CHANGES}.*/(teaching/.*|programs/.*/run|gains|process/.*|gripper)"


@dataclass(frozen=True)
class Met:
    """A problem, and which operations (`method /path`) may answer with it."""

    problem: ProblemError
    where: re.Pattern[str]

    @property
    def details(self) -> ProblemDetails:
        """The body of the answer."""
        return details_of(self.problem, request_id="0f3c9a1be4d27788")


def _met(where: str, status: int, kind: str, detail: str, advice: str, *fields: FieldProblem) -> Met:
    return Met(ProblemError(status, kind, detail, advice, fields), re.compile(where))


_AMPLITUDE = FieldProblem(field="spec.trajectory.ramp.amplitude", message="Input should be a valid number (got 'far')")
PROBLEM_EXAMPLES: tuple[Met, ...] = (
    _met(".*", 400, "http", "There was an error parsing the body", "/api/v1/openapi.json lists every address"),
    _met(".*", 401, "token-needed", "this service needs a token", "send the header Authorization: Bearer TOKEN"),
    _met(".*", 401, "token-unknown", "this token is not known, or was revoked", "`daq token ls` lists tokens by name"),
    _met(".*", 403, "unknown-name", "this service is not called 'attacker.example'", "use its address"),
    _met(CHANGES, 403, "other-origin", "a page of another origin may not do this", "use the page that is served here"),
    _met(
        f"{CHANGES}(?!.*/stop)",
        403,
        "operator-needed",
        "anna may look, and stop the robot; this needs the role operator",
        "ask for a token with the role operator",
    ),
    _met(
        "(patch|delete) .*/(experiments|schedules)/|post .*/experiments/.*/cancel",
        403,
        "owner-needed",
        "experiment morning-ramp is anna's: an operator changes and cancels only their own",
        "ask anna, or an owner of the robot; everybody who may see the robot may stop it",
    ),
    _met(
        "put .*/approval",
        403,
        "own-experiment",
        "experiment 'morning-ramp' was submitted or changed by anna: somebody else must approve it",
        "ask another operator, or an owner of the robot",
    ),
    _met(
        "put .*/approval",
        409,
        "content-changed",
        "experiment 'morning-ramp' is not what you have looked at: it, or the machine file, has changed",
        "look at it again, then approve what it is now",
    ),
    _met(
        "put .*/approval",
        409,
        "no-review",
        "experiments of ma2000 need no approval",
        "they begin without; the key `review` of the robot's configuration",
    ),
    _met(".*", 404, "not-found", "there is no robot 'other'", "this service has ma2000"),
    _met(".*", 409, "not-safe", "not while the arm is busy (experiment)", "remove the cause, then try again"),
    _met(
        "post .*/(experiments|jobs|gain)$",
        409,
        "idempotency-key",
        "Idempotency-Key 'a' was used for another request",
        "use a new key for a new request",
    ),
    _met(
        f"{CHANGES}.*/experiments/",
        409,
        "experiment-state",
        "an experiment that is done cannot be cancelled",
        "see its state: only what is queued or running can end",
    ),
    _met(
        "(post .*/jobs$|.*/jobs/)",
        409,
        "job-state",
        "the fit of 2026-10-05 14:03 UTC is running",
        "only a job that is done has a result",
    ),
    _met(
        "post .*/traces$",
        409,
        "trace-exists",
        "trace 'ramp' of 2026-10-05 14:03 UTC exists already",
        "it is the same trace: nothing needs to be done",
    ),
    _met(
        "delete .*/traces/",
        409,
        "trace-in-use",
        "trace 'ramp' of 2026-10-05 14:03 UTC is used by the fit of 2026-10-05 15:20 UTC, model 'rig b'",
        "delete those first",
    ),
    _met(
        ".*/(archive|fetch)$|get .*/traces/",
        409,
        "no-archive",
        "this service has no archive",
        "set [archive] in its daq.toml (docs/archive.md)",
    ),
    _met(
        "get .*/traces/",
        503,
        "trace-in-archive",
        "the archive has this trace, and it is being fetched: 0.0 of 1.2 MB",
        "ask again in a moment; GET …/archive says how far it is",
    ),
    _met(
        "get .*/traces/",
        503,
        "archive",
        "archive ma2000 at https://s3.lab: ma2000/2026/ramp-0f3c9a1be4d27788.mcap is not what was sent (SHA-256)",
        "try again, or look into the archive",
    ),
    _met(
        "delete .*/models/",
        409,
        "model-in-use",
        "model 'rig b, loose belt' was made from 'rig b'",
        "delete that one first",
    ),
    _met(
        "put .*/programs/",
        409,
        "program-changed",
        "program 'pick' was changed by bert meanwhile (revision 4)",
        "load it again, or keep yours under another name",
    ),
    _met(
        "put .*/programs/",
        409,
        "program-exists",
        "there is a program 'pick' already",
        "choose another name, or delete that one",
    ),
    _met("put .*/programs/", 409, "too-many-programs", "there are 1000 programs", "delete some of them first"),
    _met(
        MOVES,
        409,
        "control-needed",
        "only the client that has control can move the robot",
        "take control with POST …/control",
    ),
    _met(
        f"{MOVES}|put .*/control|post .*/(control|reset|disconnect)$",
        409,
        "control-held",
        "bert has control of the robot, for 8 s more unless it is renewed",
        "try again when it has been released",
    ),
    _met(
        f"{MOVES}|(put|delete) .*/control",
        409,
        "control-lost",
        "you no longer have control of the robot",
        "take control again",
    ),
    _met(
        "post .*/(control|queue/resume)$",
        409,
        "consent-needed",
        "serial:///dev/ttyUSB0 is a real arm: it moves only with the operator's consent",
        "is its workspace clear? then ask again with moves_real_arm",
    ),
    _met(
        f"{MOVES}|get .*/(gains|process)$|post .*/reset$",
        409,
        "arm-busy",
        "the arm is busy: lead",
        "wait for its end, or stop it",
    ),
    _met(
        "(put .*/(gains|gripper|process/outputs/.*)|post .*/reset)$",
        409,
        "order-late",
        "this order took 6.1 s to come whole: after 5 s it is not carried out",
        "send it again if it is still wanted",
    ),
    _met(
        "post .*/(teaching/.*|programs/.*/run|queue/resume)$",
        409,
        "arm-stopped",
        "the arm is stopped: by a person",
        "reset the robot when it is safe",
    ),
    _met(MOVES, 409, "stopped", "the arm has been stopped: by a person", "reset the robot when it is safe"),
    _met(
        "post .*/connect$",
        409,
        "port-in-use",
        "/dev/ttyUSB0: in use by another program",
        "end the other program, then connect again",
    ),
    _met(".*", 413, "too-large", "a body may have 16 MB", "send less at once"),
    _met(
        "post .*/traces$",
        415,
        "not-a-trace",
        "Content-Type 'image/png' is not supported",
        "send application/octet-stream or text/csv",
    ),
    _met(".*", 422, "not-valid", f"{_AMPLITUDE.field}: {_AMPLITUDE.message}", "correct the fields named", _AMPLITUDE),
    _met(
        "post .*/(experiments|experiments/preview|schedules|gain)$",
        422,
        "beyond-limits",
        "spec.trajectory: joint 2 reaches 12.0° at 0.64 s, below its limit of 20.0°",
        "POST …/experiments/preview shows the motion and its violations",
    ),
    _met("post .*/traces$", 422, "not-a-trace", "the body is empty", "send a trace"),
    _met(
        "post .*/models$",
        422,
        "not-a-model",
        "upload: not JSON: Expecting value: line 1 column 1 (char 0)",
        "send a file as `daq fit` writes it",
    ),
    _met(".*", 429, "too-many", "too many requests", "ask less often"),
    _met(".*", 503, "database", "the database: locked by another program", "try again"),
    _met(
        "post .*/(traces|experiments|experiments/preview|schedules|gain)$",
        503,
        "ending",
        "the service is ending",
        "try again when it is back",
    ),
    _met(
        "get .*/system$|post .*/(experiments|gain)$",
        503,
        "traces-away",
        "the folder of traces, /srv/traces: No such file or directory",
        "mount its disk, then try again",
    ),
    _met(
        f"{MOVES}|get .*/(gains|process)$|post .*/(connect|reset)$",
        503,
        "not-reached",
        "robot ma2000 is not connected",
        "check cable and supply, then connect again",
    ),
    _met(".*", 507, "no-room", "the disk of the database is full", "free some space on it"),
    _met(
        ".*",
        503,
        "disk",
        "the disk: Read-only file system",
        "the operating system's log says why; make it writable, then try again",
    ),
    # At addresses that are not in the description, or at every address and never.
    _met(
        NOWHERE,
        401,
        "ticket-unknown",
        "this ticket was used, is too old, or its token was revoked",
        "ask for a new one",
    ),
    _met(
        NOWHERE, 405, "no-such-method", "PUT /api/v1/me: Method Not Allowed", "/api/v1/openapi.json lists every address"
    ),
    _met(NOWHERE, 431, "head-too-large", "a request may have 100 headers", "send fewer and shorter headers"),
    _met(NOWHERE, 500, "fault", "KeyError: an error of this program", "the log has details under the request's id"),
    _met(NOWHERE, 403, "sign-in-unknown", "this answer of the provider was used, or is too old", "begin anew"),
    _met(NOWHERE, 403, "sign-in-refused", "the provider refused: access_denied", "see its own message"),
    _met(NOWHERE, 403, "sign-in-not-proven", "the ID token is not for this service", "see the service's log"),
    _met(NOWHERE, 403, "no-role", "none of the person's groups has a role", "see `oidc.roles`"),
    _met(NOWHERE, 403, "no-name", "the claim has no usable name", "see `oidc.name_claim`"),
    _met(
        NOWHERE, 403, "name-taken", "somebody else has had the name anna first", "ask whoever looks after the service"
    ),
    _met(NOWHERE, 503, "provider-away", "the provider does not answer", "try again, or use a token"),
)
