"""`daq blind`: hides effects in the mock, diagnoses blindly, reveals and scores."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq_cli.app.context import JsonOption, console, print_json

if TYPE_CHECKING:
    from trials.blind.campaign import Campaign

app = typer.Typer(add_completion=False)


@app.command()
def blind(
    context: typer.Context,
    folder: Annotated[Path, typer.Option(help="Folder that keeps everything; an interrupted trial continues there.")],
    seeds: Annotated[str | None, typer.Option(help="Numbers of the arms: FIRST:LAST, or a list with commas.")] = None,
    cases: Annotated[int | None, typer.Option(min=1, help="Use at most this number of arms, of mixed kinds.")] = None,
    kinds: Annotated[
        str, typer.Option(help="Kinds of arms: clean, single, open-set, pair, shared, wrong-priors, later.")
    ] = "clean,single,open-set",
    loads: Annotated[
        str, typer.Option(help="Loads that the arms carry, in turn: nominal, light, heavy.")
    ] = "nominal,nominal,nominal,light,heavy",
    experiment: Annotated[
        Literal["diagnostic", "ramp"], typer.Option(help="The diagnostic set of 55 s, or the ramp step alone, 8 s.")
    ] = "diagnostic",
    registration: Annotated[
        Path | None,
        typer.Option(help="Run a registered trial: its cases and experiments, with seeds drawn from its commit."),
    ] = None,
    run: Annotated[str, typer.Option(help="Name of the run of the registered trial.")] = "diagnostic",
    workers: Annotated[int, typer.Option(min=1, max=1000, help="Number of worker processes.")] = 1,
    until: Annotated[
        Literal["detect", "record", "diagnose", "score"], typer.Option(help="Last stage to carry out.")
    ] = "score",
    seconds: Annotated[
        float | None,
        typer.Option(min=0, help="Begin nothing more after this time, in s; the same command continues. 0: the table."),
    ] = None,
    hashes: Annotated[
        bool,
        typer.Option("--hashes", help="Print the hashes and versions for a registration, and run nothing."),
    ] = False,
    json: JsonOption = False,
) -> None:
    """Hide effects in the mock, diagnose blindly, reveal, and score."""
    from daq.contracts.extras import require_extra
    from daq.executors import LocalWorkers
    from daq.executors.local import ending
    from trials.blind.campaign import Campaign
    from trials.blind.folder import TrialFolder
    from trials.blind.registered import to_register

    if hashes:
        print(to_register())
        return
    require_extra("model", "daq blind", "numba")
    if registration is not None:
        _refuse_beside_registration(context)
        chosen, experiment, drawn = _registered(registration, run)
    elif seeds is None:
        raise SpecError("--seeds or --registration: one of them is needed")
    else:
        chosen, drawn = _chosen(seeds, kinds, loads, cases), None
    kept = TrialFolder.open(folder.absolute(), experiment, drawn)
    campaign = Campaign(kept, load_machine("ma2000"), until=until)
    count = len(set(chosen))
    with ending(LocalWorkers(workers)) as pool:
        left = campaign.run(chosen, pool, lambda number, said: console().print(f"{number}/{count}  {said}"), seconds)
    _show(campaign, folder, as_json=json)
    if left:
        console().print(f"{left} cases are not done; the same command continues with them")
        raise typer.Exit(exit_codes.FAULT)


def _refuse_beside_registration(context: typer.Context) -> None:
    """Raises SpecError for options that a registered run does not accept."""
    why = {
        "seeds": "name one of them; a registered trial draws its own",
        "cases": "a registered run has all cases that it registers",
        **dict.fromkeys(("kinds", "loads", "experiment"), "a registered run takes this from its registration"),
    }
    if own := [name for name in why if _asked_for(context, name)]:
        raise SpecError(f"--{own[0]} and --registration: {why[own[0]]}")


def _asked_for(context: typer.Context, option: str) -> bool:
    source = context.get_parameter_source(option)
    return source is not None and source.name == "COMMANDLINE"


def _chosen(seeds: str, kinds: str, loads: str, cases: int | None) -> list[int]:
    from trials.blind.registration import KINDS, LOADS, arms, parse_choice, parse_numbers, sample_arms

    found = arms(parse_numbers(seeds), parse_choice(kinds, KINDS, "kind"), parse_choice(loads, LOADS, "load"))
    return found if cases is None else sample_arms(found, cases)


def _registered(path: Path, run: str) -> tuple[list[int], Literal["diagnostic", "ramp"], dict[str, str]]:
    """Returns the seeds, the experiment, and the registration."""
    from trials.blind.registered import read_registration

    registration, commit = read_registration(path, run)
    chosen = registration.run(run)
    if chosen.acquire:
        raise SpecError(f"run {run}: its diagnosis asks for further experiments, which a trial no longer runs")
    origin = {"file": path.name, "sha256": sha256(path.read_bytes()).hexdigest(), "run": run, "commit": commit}
    return registration.arms(run, commit), chosen.experiment, origin


def _show(campaign: Campaign, folder: Path, *, as_json: bool) -> None:
    from trials.blind.table import as_csv, as_markdown

    table = campaign.table()
    (folder / "cases.csv").write_text(as_csv(campaign.scores()), "utf-8")
    (folder / "table.json").write_text(table.model_dump_json(indent=1) + "\n", "utf-8")
    (folder / "table.md").write_text(as_markdown(table), "utf-8")
    if as_json:
        print_json(table.model_dump(mode="json"))
    else:
        print(as_markdown(table))
