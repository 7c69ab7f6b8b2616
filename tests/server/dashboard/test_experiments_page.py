"""The page of experiments: written in a form, seen before it is sent, followed in the queue to its trace."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import APIResponse, Locator, Page, Playwright, Request, Route, WebSocketRoute, expect

from tests.server.dashboard.browser import TABLET, WIDE, WITH_3D, Dashboard, MockControl, chromium, watched
from tests.server.dashboard.faults import faults_in_both_schemes
from tests.server.service import Service

pytestmark = [pytest.mark.browser, pytest.mark.slow]
SHORT = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}


@pytest.fixture
def form(dashboard: Dashboard) -> Page:
    """The page, once its form can be used."""
    page = dashboard.open("experiments")
    expect(page.get_by_role("combobox", name="Start from")).to_be_visible()
    return page


@pytest.fixture
def paused(dashboard: Dashboard) -> Iterator[Dashboard]:
    """The queue takes nothing: what is submitted waits."""
    dashboard.service.robot.post("/queue/pause")
    yield dashboard
    for one in dashboard.service.robot.get("/queue/experiments").json():
        dashboard.service.robot.post(f"/experiments/{one['id']}/cancel")


def _submit(dashboard: Dashboard, **more: Any) -> str:
    answer = dashboard.service.robot.post("/experiments", json={"spec": SHORT | more})
    assert answer.status_code == 201, answer.text
    number: str = answer.json()["id"]
    return number


def _amplitude(page: Page) -> Locator:
    return page.get_by_role("textbox", name="Amplitude", exact=False).first


def _waiting(page: Page) -> Locator:
    return page.get_by_role("list", name="Experiments that wait, the next one first").get_by_role("listitem")


def test_a_limit_that_would_be_broken_is_marked_and_nothing_is_sent(dashboard: Dashboard, form: Page) -> None:
    before = len(dashboard.service.robot.get("/experiments").json()["items"])
    _amplitude(form).fill("200")
    broken = form.get_by_role("list", name="Limits that the motion exceeds")
    expect(broken.get_by_text(re.compile(r"joint 2: 24\d\.\d\d° at .* allowed are .* to 224\.6"))).to_be_visible()
    expect(form.get_by_text("this motion would break a limit: see the preview")).to_be_visible()
    form.get_by_role("button", name="Add to the queue").press("Enter")
    broken.get_by_role("button", name="show").first.click()
    expect(form.get_by_role("slider", name="Moment of the motion")).not_to_have_value("0")
    assert len(dashboard.service.robot.get("/experiments").json()["items"]) == before
    _amplitude(form).fill("5")
    expect(form.get_by_text("motion within its limits")).to_be_visible()
    expect(broken).not_to_be_attached()


def test_a_field_says_what_is_allowed_and_the_button_stays_under_the_pointer(form: Page) -> None:
    button = form.get_by_role("button", name="Add to the queue")
    duration = form.get_by_role("textbox", name="Duration")
    button.scroll_into_view_if_needed()
    place = button.bounding_box()
    duration.fill("0")
    expect(form.get_by_role("button", name="Duration: allowed: more than 0, up to 3600 s")).to_be_visible()
    assert button.bounding_box() == place
    assert place is not None
    form.mouse.click(place["x"] + 10, place["y"] + 10)
    expect(duration).to_be_focused()
    duration.fill("0.5")
    duration.blur()
    expect(form.get_by_text("allowed: more than 0, up to 3600 s")).not_to_be_visible()
    assert button.bounding_box() == place


def test_a_preset_fills_the_form_and_can_be_changed_as_text(dashboard: Dashboard, form: Page) -> None:
    form.get_by_role("combobox", name="Start from").select_option("diagnostic-c")
    expect(form.get_by_text("staircases of 0.3°, 1° and 3°")).to_be_visible()
    expect(form.get_by_text("3 parts, one after the other")).to_be_visible()
    form.get_by_role("button", name="Edit as text").click()
    text = form.get_by_role("textbox", name="Specification")
    expect(text).to_have_value(re.compile('"kind": "sequence"'))
    text.fill('{"trajectory": {"kind": "spiral"}}')
    written = form.get_by_role("form", name="New experiment")
    expect(written.get_by_text(re.compile("trajectory: Input tag 'spiral'"))).to_be_visible()
    dashboard.forgive()  # what is not a specification is a 422, which the browser notes
    text.fill('{"trajectory": {"kind": "cubic", "amplitude": 0.1}, "joints": [2]}')
    expect(form.get_by_text("motion within its limits")).to_be_visible()
    form.get_by_role("button", name="Edit as text").click()
    expect(form.get_by_role("combobox", name="Motion")).to_have_value("cubic")
    expect(_amplitude(form)).to_have_value("5.72958")
    expect(form.get_by_role("checkbox", name="Joint 1 moves")).not_to_be_checked()


def test_joints_can_have_amplitudes_starts_and_gains_of_their_own(dashboard: Dashboard, form: Page) -> None:
    form.get_by_role("checkbox", name="Joint 3 moves").uncheck()
    form.get_by_role("checkbox", name="A different amplitude for each joint").check()
    form.get_by_role("textbox", name="Amplitude of joint 1").fill("4")
    form.get_by_role("textbox", name="Amplitude of joint 2").fill("-3")
    form.get_by_role("textbox", name="Start of joint 3").fill("30")
    form.get_by_text("Gains P, I, D").click()
    form.get_by_role("textbox", name="P of joint 2").fill("3")
    form.get_by_role("textbox", name="I of joint 2").fill("0")
    gain = form.get_by_role("textbox", name="D of joint 2")
    gain.fill("21")
    expect(gain).to_have_attribute("aria-invalid", "true")
    dashboard.service.robot.post("/queue/pause")
    gain.fill("1")
    form.get_by_role("button", name="Add to the queue").press("Enter")  # also while the motion is still being checked
    expect(_waiting(form)).to_have_count(1)
    form.get_by_role("button", name="Motion of ramp").click()
    expect(form.get_by_text("of ramp-joints-1-2-4--3deg-start-gains, which waits")).to_be_visible()
    (sent,) = dashboard.service.robot.get("/queue/experiments").json()
    assert sent["spec"]["name"] == "ramp-joints-1-2-4--3deg-start-gains"  # it says what differs from the preset
    degree = 0.017453292519943295
    assert sent["spec"]["trajectory"]["amplitude"] == pytest.approx({"1": 4 * degree, "2": -3 * degree})
    assert sent["spec"]["start"] == pytest.approx({"3": 30 * degree})
    assert sent["spec"]["gains"] == {"2": [3, 0, 1]}


def test_the_queue_is_paused_put_in_another_order_taken_back_and_resumed(paused: Dashboard, form: Page) -> None:
    for name in ("first", "second", "third"):
        _submit(paused, name=name)
    rows = _waiting(form)
    expect(rows).to_have_text([re.compile("first"), re.compile("second"), re.compile("third")])
    expect(form.get_by_text("Paused:", exact=True)).to_be_visible()
    form.get_by_role("button", name="Run third earlier").click()
    expect(rows).to_have_text([re.compile("first"), re.compile("third"), re.compile("second")])
    form.get_by_role("button", name="Run first later").click()
    expect(rows).to_have_text([re.compile("third"), re.compile("first"), re.compile("second")])
    form.get_by_role("button", name="Remove second from the queue").click()
    expect(rows).to_have_count(2)
    names = [one["spec"]["name"] for one in paused.service.robot.get("/queue/experiments").json()]
    assert names == ["third", "first"]
    form.get_by_role("button", name="Resume the queue").press("Enter")
    expect(form.get_by_text("The queue is empty")).to_be_visible()
    assert form.evaluate("document.activeElement.tagName") == "DIV"  # what is around the button that went away
    expect(form.get_by_role("link", name="Trace of third").first).to_be_visible()


def test_what_runs_shows_its_progress_and_is_stopped_from_the_queue(dashboard: Dashboard, form: Page) -> None:
    _submit(dashboard, name="long", trajectory={"kind": "pause", "duration": 120})
    expect(form.get_by_role("progressbar", name="Progress of long")).to_be_visible()
    expect(form.get_by_text(re.compile(r"of \d+"))).to_be_visible()
    form.get_by_role("button", name="Stop the experiment").click()
    expect(form.get_by_text("The arm is stopped.")).to_be_visible()
    expect(form.get_by_text("stopped", exact=True).first).to_be_visible()
    assert dashboard.mock is not None
    assert dashboard.mock.ask("state")["frozen"]


def test_an_experiment_waits_for_its_time_and_one_is_run_every_so_often(dashboard: Dashboard, form: Page) -> None:
    form.get_by_role("radio", name="At a time").check()
    form.get_by_role("button", name="Add to the queue").click()
    expect(_waiting(form).first).to_contain_text(re.compile(r"in (9|10) min"))
    form.get_by_role("button", name=re.compile("Remove .* from the queue")).click()
    form.get_by_role("radio", name="Repeatedly").check()
    form.get_by_role("textbox", name="Every", exact=True).fill("5")
    form.get_by_role("combobox", name="Unit").select_option("s")
    expect(form.get_by_text("Every: allowed: 10 s to 366 d")).to_be_visible()
    form.get_by_role("combobox", name="Unit").select_option("h")
    form.get_by_role("textbox", name="Number of runs").fill("10")
    dashboard.service.robot.post("/queue/pause")
    form.get_by_role("button", name="Add the schedule").click()
    row = form.get_by_role("row", name=re.compile("ramp"))
    expect(row).to_contain_text("5 h")
    expect(form.get_by_role("link", name="Show the plan")).to_be_visible()
    form.get_by_role("radio", name="On days").check()
    expect(form.get_by_text("Days: choose at least one day")).to_be_visible()  # none is armed by one press
    form.get_by_role("radio", name="Repeatedly").check()
    form.get_by_role("button", name="Add the schedule").click()
    expect(form.get_by_text("this experiment is planned already, every 5 h")).to_be_visible()
    dashboard.forgive()  # a refused request is an error on the console
    expect(row).to_contain_text(re.compile(r"[01] / 10"))
    row.get_by_role("button", name="Turn off").click()
    expect(row).to_contain_text("off")
    row.get_by_role("button", name=re.compile("Delete the schedule")).click()
    expect(row).not_to_be_attached()
    assert dashboard.service.robot.get("/schedules").json()["items"] == []


def test_times_are_told_by_the_clock_of_the_service(paused: Dashboard) -> None:
    paused.page.add_init_script("const own = Date.now; Date.now = () => own() - 3600000")
    at = datetime.now(UTC) + timedelta(minutes=10)
    sent = paused.service.robot.post("/experiments", json={"spec": SHORT, "at": at.isoformat()})
    assert sent.status_code == 201, sent.text
    expect(_waiting(paused.open("experiments")).first).to_contain_text(re.compile(r"in (9|10) min"))


def test_a_list_that_comes_after_a_newer_one_is_left_aside(paused: Dashboard, form: Page) -> None:
    number = _submit(paused, name="taken-back")
    expect(_waiting(form)).to_have_count(1)
    older: list[tuple[Route, APIResponse]] = []

    def hold_first(route: Route) -> None:
        if older:
            route.continue_()
        else:
            older.append((route, route.fetch()))

    form.route("**/queue/experiments", hold_first)
    paused.service.robot.post("/queue/pause")
    while not older:
        form.wait_for_timeout(20)  # lets the page ask; the test's own time limit ends the wait
    paused.service.robot.post(f"/experiments/{number}/cancel")
    expect(_waiting(form)).to_have_count(0)
    route, response = older[0]
    with form.expect_event("requestfinished", lambda request: request == route.request):
        route.fulfill(response=response)
    form.evaluate("new Promise(requestAnimationFrame)")
    expect(_waiting(form)).to_have_count(0)


def test_whoever_uses_the_page_attends_what_runs_on_a_real_arm(paused: Dashboard) -> None:
    def as_if_real(route: WebSocketRoute) -> None:
        server = route.connect_to_server()

        def tell(message: str | bytes) -> None:
            text = str(message).replace('"simulated":true', '"simulated":false')
            route.send(text.replace('"running":null', '"running":"a"'))

        server.on_message(tell)

    page = paused.page
    page.route_web_socket(re.compile("/live"), as_if_real)
    requested: list[str] = []

    def note(request: Request) -> None:
        requested.append(request.url)

    page.on("request", note)
    paused.open("experiments")
    expect(page.get_by_text("Paused:", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="I am present")).to_be_visible()
    assert [url for url in requested if "attend" in url] == []
    with page.expect_request("**/queue/attend"):
        page.keyboard.press("Tab")


def test_the_queue_says_that_it_waits_for_whoever_has_the_control(dashboard: Dashboard, form: Page) -> None:
    lease = dashboard.service.robot.post("/control", json={}).json()["lease"]
    expect(
        form.get_by_text("Somebody at the service’s computer has control of the arm: the queue waits")
    ).to_be_visible()
    dashboard.service.robot.request("DELETE", "/control", headers={"Control-Lease": lease})
    expect(form.get_by_text("has control of the arm")).not_to_be_attached()


def test_the_motion_is_shown_in_3d_and_turned_with_the_keyboard(
    driver: Playwright, served: tuple[Service, MockControl]
) -> None:
    with chromium(driver, *WITH_3D) as browser:
        form = watched(browser.new_context(viewport=WIDE), *served).open("experiments")
        picture = form.get_by_label("The motion in 3-D")
        expect(picture).to_have_accessible_description(re.compile(r"End of the arm at x −?\d+.*1 waist 180\.0°"))
        expect(picture).to_be_visible()
        place = picture.bounding_box()
        assert place is not None
        before = form.screenshot(clip=place)
        picture.focus()
        for _ in range(6):
            form.keyboard.press("ArrowRight")
        assert form.screenshot(clip=place) != before
        form.get_by_role("slider", name="Moment of the motion").fill("2")
        expect(picture).to_have_accessible_description(re.compile("1 waist 201.6°"))


def test_the_motion_is_told_in_words_where_a_browser_shows_no_3d(form: Page) -> None:
    expect(form.get_by_text("This browser shows no 3-D")).to_be_visible()
    expect(form.get_by_text(re.compile(r"Joints: 1 waist 180\.0°")).first).to_be_visible()


def test_it_fits_a_tablet_and_axe_finds_no_fault_while_limits_are_broken(form: Page) -> None:
    form.set_viewport_size(TABLET)
    expect(form.get_by_text("motion within its limits")).to_be_visible()
    assert form.evaluate("document.documentElement.scrollWidth <= innerWidth")
    expect(form.get_by_role("button", name="Add to the queue")).to_be_in_viewport()
    form.set_viewport_size(WIDE)
    _amplitude(form).fill("200")
    expect(form.get_by_role("list", name="Limits that the motion exceeds")).to_be_visible()
    form.get_by_role("radio", name="Repeatedly").check()
    assert faults_in_both_schemes(form) == []


def test_an_experiment_that_has_ended_is_run_again_by_way_of_the_form(dashboard: Dashboard, form: Page) -> None:
    service = dashboard.service
    spec = {"name": "once-more", "trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.4}, "hold": 0.1}
    first = service.end_of(service.robot.post("/experiments", json={"spec": spec}).json()["id"])
    form.get_by_role("button", name="Edit and run again: once-more").first.click()
    expect(form.get_by_label("Name", exact=True)).to_have_value("once-more")
    assert service.robot.get("/queue/experiments").json() == []
    form.get_by_role("button", name="Add to the queue").click()
    own = form.locator("section", has=form.get_by_role("heading", name="Your run"))
    own.get_by_role("button", name="Back to the preview").click()
    expect(form.get_by_text("motion within its limits")).to_be_visible()
    again = service.robot.get("/experiments", params={"limit": 1}).json()["items"][0]
    assert again["id"] != first["id"]
    assert again["spec"] == first["spec"]
    assert service.end_of(again["id"])["state"] == "done"


def test_on_a_phone_what_is_pressed_in_the_queue_stays_in_its_place(dashboard: Dashboard, form: Page) -> None:
    form.set_viewport_size({"width": 360, "height": 740})
    form.get_by_role("button", name="Pause").click()
    resume = form.get_by_role("button", name="Resume")
    expect(resume).to_be_visible()
    add, below = (one.bounding_box() for one in (form.get_by_role("form", name="New experiment"), resume))
    assert add is not None
    assert below is not None
    assert add["y"] < below["y"]


def test_a_run_that_ended_on_live_is_what_the_form_is_filled_with(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    ramp = {"kind": "ramp", "amplitude": 0.05, "duration": 1.25}
    spec = {"name": "slow", "trajectory": ramp, "hold": 0.1}
    dashboard.service.end_of(dashboard.service.robot.post("/experiments", json={"spec": spec}).json()["id"])
    page.get_by_role("button", name="Last result").click()
    page.get_by_role("button", name="Edit and run again").click()
    expect(page.get_by_role("textbox", name="Duration")).to_have_value("1.25")
    expect(page).to_have_url(re.compile("#/experiments$"))
    expect(page.get_by_text("motion within its limits")).to_be_visible()
    expect(page.get_by_label("Name", exact=True)).to_have_value("slow")


def test_a_schedule_may_begin_later(dashboard: Dashboard, form: Page) -> None:
    form.get_by_label("Repeatedly").check()
    form.get_by_label("First run").fill("2199-01-02T03:04")
    form.get_by_role("button", name="Add the schedule").click()
    expect(form.get_by_text(re.compile("Planned: every 30 min, next on 02 Jan 2199"))).to_be_visible()
    made = dashboard.service.robot.get("/schedules", params={"limit": 1}).json()["items"][0]
    assert made["next"].startswith(("2199-01-01", "2199-01-02"))
    dashboard.service.robot.delete(f"/schedules/{made['id']}")
