"""The live page without a browser: the numbers of the command, files that confirm them, and a server that refuses."""

from __future__ import annotations

import contextlib
import http.client
import json
import resource
import shlex
import shutil
import signal
import socket
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import written
from tests.studies.command import ROOT, command, tolalloc
from tests.studies.live_page import STUDY
from tolalloc.cli.live.desk import Desk, Job
from tolalloc.cli.live.server import LARGEST, MOST_CONNECTIONS, Address, LiveServer
from tolalloc.cli.live.session import LiveDesign, Session
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers import TORQUE
from tolalloc.study.prepared import Prepared
from tolalloc.study.script import load_study


@pytest.fixture
def script(tmp_path) -> Path:
    return written(tmp_path / "fit.py", STUDY)


def desk_of(script: Path) -> Desk:
    return Desk(session=Session(prepared=Prepared(study=load_study(script))), script=script)


@pytest.fixture
def desk(script) -> Desk:
    return desk_of(script)


def ask(desk: Desk, request: str, /, **sent):
    return desk.answer(request, {"tab": "tab", "turn": 1, **sent})


def compared(result, found) -> None:
    """Assert that the page's record says what the command's answer says, to the last digit."""
    assert found["yield"][0] == 100 * result.yields[1] / 100
    told = [item["value"] for own in found["outputs"] for item in own["quantiles"]]
    assert told == [after for _, after in result.quantiles]


@pytest.mark.parametrize("units", [256, 1000, 1024])
def test_the_page_says_the_digits_of_whatif(script, desk, units):
    zones = {"housing": 20.0, "shaft": 33.0}
    answer = load_study(script).ask(ta.Difference(zones=zones, units=units)).result
    compared(answer, ask(desk, "units", design={"zones": zones}, units=units))
    priced = ask(desk, "design", design={"zones": zones})
    assert priced["cost"] == answer.whole_cost + answer.cost_change
    assert priced["before"] == answer.whole_cost


@pytest.mark.slow
def test_the_page_says_the_digits_of_whatif_on_a_reducer():
    script = Path(__file__).parents[2] / "studies" / "liu2020_allocation.py"
    zones = {"pin.diameter": 3.0, "disc1.pitch": 10.0}
    answer = load_study(script).ask(ta.Difference(zones=zones, units=300)).result
    found = ask(desk_of(script), "units", design={"zones": zones}, units=300)
    compared(answer, found)
    worst = found["outputs"][0]["worst"]
    drawn = ask(desk_of(script), "design", design={"zones": zones}, unit=worst)
    assert drawn["values"][0]["value"] == pytest.approx(answer.values[1].max(), rel=1e-5)
    curve = drawn["figures"][0]["series"][-1]["y"]
    # the command's peak-to-peak is searched between the angles of the curve
    assert max(curve) - min(curve) == pytest.approx(answer.values[1].max(), rel=5e-3)


@pytest.mark.slow
def test_another_torque_says_the_digits_of_a_study_at_that_torque(tmp_path):
    shutil.copy(ROOT / "studies" / "liu2020_allocation.py", tmp_path)
    script = tmp_path / "liu2020_allocation.py"
    desk = desk_of(script)
    design = {"zones": {"pin.diameter": 3.0}, "settings": {TORQUE: 167.0}}
    found, one = ask(desk, "units", design=design, units=64), ask(desk, "design", design=design, unit=5)
    assert found["outputs"] != ask(desk, "units", design={"zones": design["zones"]}, units=64)["outputs"]
    ask(desk, "save", design=design, name="loaded")
    saved = desk_of(tmp_path / "loaded.py")
    assert saved.session.described["conditions"] == [[TORQUE, 167.0]]
    assert ask(saved, "units", design={}, units=64) == found
    again = ask(saved, "design", design={}, unit=5)
    assert [again[key] for key in ("values", "figures")] == [one[key] for key in ("values", "figures")]
    for torque, allowed in ((0.0, "but not 0"), (400.0, "-334 to 334")):
        with pytest.raises(InputError, match=allowed):
            ask(desk, "design", design={"settings": {TORQUE: torque}})


def test_the_limit_of_the_peak_to_peak_stands_around_the_middle_of_the_curve():
    desk = desk_of(ROOT / "studies" / "liu2020_allocation.py")
    first, *others = ask(desk, "design", unit=2)["figures"]
    (low, _), (high, name) = first["horizontal"]
    curve = first["series"][-1]["y"]
    limit = desk.session.prepared.requirements[0].limits.upper
    assert high - low == pytest.approx(limit)
    assert high + low == pytest.approx(min(curve) + max(curve), abs=1e-3)
    assert name == f"limit {limit:g} arcsec peak to peak"
    assert not any(own["horizontal"] for own in others)


def test_zones_scaled_alike_stay_in_their_ranges_and_cost_less_the_wider_they_are(tmp_path):
    script = tmp_path / "fit.py"
    script.write_text(
        STUDY.replace('"shaft", "nominal": 30.0, ', '"shaft", "nominal": 30.0, "locked": True, '), encoding="utf-8"
    )
    desk = desk_of(script)
    designs = ask(desk, "scaled", design={"settings": {"shim [mm]": 0.02}})["designs"]
    costs = [own["cost"] for own in designs]
    assert costs == sorted(costs, reverse=True)
    factors = [own["factor"] for own in designs]
    assert costs[factors.index(1.0)] == ask(desk, "design", design={})["cost"]
    widest = {"zones": {"housing": 40.0 * factors[-1]}, "settings": {"shim [mm]": 0.02}}  # 88 of at most 100 µm
    assert costs[-1] == pytest.approx(ask(desk, "design", design=widest)["cost"])
    told = [item["value"] for item in ask(desk, "units", design=widest, units=256)["outputs"][0]["quantiles"]]
    assert designs[-1]["quantiles"][0] == told
    ask(desk, "design", turn=5, design={})
    assert ask(desk, "scaled", turn=4, design={"settings": {"shim [mm]": 0.03}}) == {"called off": True}


def test_a_question_says_its_stage_and_what_is_done_and_left(desk, monkeypatch):
    monkeypatch.setattr(Job, "_run", lambda _: None)
    ask(desk, "ask", question="ranking", design={})
    job = desk._jobs["tab"]
    job.begin("first")
    job.advance(7)
    job.begin("second", 10, "blocks")
    job.advance(3)
    job.tell("half of it is known")
    state = ask(desk, "state")
    assert {key: state[key] for key in ("stage", "units", "expected", "counted", "solved", "told")} == {
        "stage": "second",
        "units": 3,
        "expected": 10,
        "counted": "blocks",
        "solved": 10,
        "told": "half of it is known",
    }


def test_the_command_after_saving_runs_from_any_folder(tmp_path):
    folder = tmp_path / "my studies"
    folder.mkdir()
    (folder / "fit.py").write_text(STUDY, encoding="utf-8")
    said = ask(desk_of(folder / "fit.py"), "save", design={"zones": {"shaft": 41.7}}, name="tighter")
    program, word, script = shlex.split(said["command"])
    assert (program, word) == ("tolalloc", "run")
    assert load_study(Path(script)).drawing.sources[1].zone == pytest.approx(41.7e-6)


@pytest.mark.slow
def test_the_picture_follows_a_swept_error():
    desk = desk_of(ROOT / "studies" / "liu2020_allocation.py")
    swept = ask(desk, "sweep", unit=3, source="disc1.runout")
    scenes = [ask(desk, "scene", unit=3, source="disc1.runout", share=share)["scene"] for share in (-1.0, 1.0)]
    curves = [scene["forward"]["transmission_error"]["data"] for scene in scenes]
    assert curves[0] != curves[1] != ask(desk, "scene", unit=3)["scene"]["forward"]["transmission_error"]["data"]
    assert len(swept["curves"]) == len(swept["figure"]["series"][0]["x"])
    for sent, said in (
        ({"share": 1.5, "source": "disc1.runout"}, "from -1 to 1"),
        ({"source": "disc"}, "disc2.runout"),
    ):
        with pytest.raises((InputError, UnknownNameError), match=said):
            ask(desk, "scene", unit=3, **sent)


def test_a_yield_is_one_of_all_limits_with_its_interval(desk):
    found = ask(desk, "units", design={}, units=1024)
    values = desk.session._known[LiveDesign.read({}, desk.session.prepared)][:, 0]
    kept = (values >= 0.07) & (values <= 0.11)
    assert found["yield"][0] == kept.mean()
    assert found["yield"][1] < kept.mean() < found["yield"][2]
    assert values[found["outputs"][0]["worst"] - 1] == values.max()
    reject = found["outputs"][0]["reject"]
    assert not kept[reject - 1] and kept[: reject - 1].all()
    assert found["broken"] == {}
    assert sum(found["outputs"][0]["histogram"]["y"]) == pytest.approx(100.0)


def test_more_units_keep_the_first_ones_and_a_newer_request_calls_off_an_older_one(desk):
    few = ask(desk, "units", design={}, units=256)
    ask(desk, "units", design={}, units=2048)
    assert ask(desk, "units", design={}, units=256) == few
    asked = iter([True, True, False])
    design = LiveDesign.read({"zones": {"shaft": 30.0}}, desk.session.prepared)
    assert desk.session.units(design, 6144, lambda: next(asked)) is None
    assert len(desk.session._known[design]) == 256  # two looks' worth, kept for the next time
    ask(desk, "design", turn=8, design={})
    assert ask(desk, "units", turn=7, design={"zones": {"shaft": 29.0}}, units=256) == {"called off": True}
    assert ask(desk, "units", turn=7, tab="other", design={"zones": {"shaft": 29.0}}, units=256)["units"] == 256


def test_a_unit_comes_again_and_a_source_is_swept_over_its_zone(desk):
    first = ask(desk, "design", design={}, unit=7)
    ask(desk, "design", design={"zones": {"shaft": 20.0}}, unit=7)
    assert ask(desk, "design", design={}, unit=7) == first
    assert first["figures"] == []
    exact = ask(desk, "design", design={}, unit=0)["values"][0]["value"]
    assert exact == pytest.approx(30.1 - 30.0 - 0.01)
    swept = ask(desk, "sweep", design={"zones": {"shaft": 20.0}}, unit=0, source="shaft")
    series = swept["figure"]["series"][0]
    assert (series["x"][0], series["x"][-1]) == (-1.0, 1.0)
    assert swept["spread"] == pytest.approx(0.02)  # a full zone of 20 µm
    assert ask(desk, "scene", design={}, unit=7) == {"scene": None}


def test_a_setting_moves_the_answer_and_keeps_its_bounds(desk):
    free, shimmed = (ask(desk, "units", design={"settings": {"shim [mm]": own}}, units=256) for own in (0.0, 0.05))
    shift = free["outputs"][0]["quantiles"][0]["value"] - shimmed["outputs"][0]["quantiles"][0]["value"]
    assert shift == pytest.approx(0.05)
    with pytest.raises(InputError, match=r"0 to 0\.05"):
        ask(desk, "units", design={"settings": {"shim [mm]": 0.06}}, units=256)


def test_turned_flanks_are_chosen_on_the_page_and_saved_with_the_study(tmp_path):
    """What the page says at 2 µm is what the model says there, and the saved study says it again."""
    text = (ROOT / "studies" / "liu2020_allocation.py").read_text("utf-8")
    script = tmp_path / "turned.py"
    ranges = "radial_clearance=(5.0, 20.0), rotation_clearance=(0.0, 4.0)"
    script.write_text(text.replace("radial_clearance=(5.0, 20.0)", ranges), encoding="utf-8")
    desk, turned = desk_of(script), {"rotation clearance [µm]": 2.0}
    named = [own["name"] for own in desk.session.described["settings"][:3]]
    assert named == ["rotation clearance [µm]", "flank clearance [µm]", "radial clearance [µm]"]
    plain, found = (ask(desk, "units", design={"settings": own}, units=64) for own in ({}, turned))
    assert found["outputs"] != plain["outputs"]
    ask(desk, "save", design={"settings": turned}, name="chosen")
    assert ask(desk_of(tmp_path / "chosen.py"), "units", design={}, units=64)["outputs"] == found["outputs"]


def test_a_setting_outside_what_it_may_become_is_said_until_it_is_moved_inside(script):
    script.write_text(STUDY.replace("lower=0.0", "lower=0.02"), encoding="utf-8")
    desk = desk_of(script)
    (said,) = ask(desk, "examined", design={}, units=256)["sentences"]
    assert said.startswith("shim: 0.01 mm today, not among the 0.02…0.05 mm that it may become")
    assert ask(desk, "examined", design={"settings": {"shim [mm]": 0.03}}, units=256)["sentences"] == []


@pytest.mark.slow
def test_what_a_check_says_of_units_is_what_the_verdict_says_of_them_over_fifty_moves(tmp_path):
    """The share that is preloaded, and the friction torque of 99.73 %: each stands in two places of the page."""
    text = (ROOT / "studies" / "rv20e_allocation.py").read_text("utf-8")
    script = tmp_path / "as_warm_as_the_ring.py"
    script.write_text(text.replace("ta.at(ta.FRICTION_TORQUE, WARM)", "ta.FRICTION_TORQUE"), encoding="utf-8")
    stiffness = "rv20e_catalogue.stiffness.toml"
    (tmp_path / stiffness).write_bytes((ROOT / "studies" / stiffness).read_bytes())
    desk, rng = desk_of(script), np.random.default_rng(5)
    for move in range(50):
        zones = {name: float(rng.uniform(8.0, 16.0)) for name in ("disc1.runout", "disc2.runout")}
        design = {"settings": {"radial clearance [µm]": float(rng.integers(3, 15))}, "zones": zones}
        units = 1024 if move == 0 else 256
        judged = ask(desk, "units", design=design, units=units)
        said = " ".join(ask(desk, "examined", design=design, units=units)["sentences"]).replace("\u00a0", " ")
        (broken,) = judged["broken"].values()
        assert f"Of {units:,} simulated reducers {broken:.1%} are preloaded".replace("%", " %") in said
        (friction,) = (own for own in judged["outputs"] if "friction" in own["name"])
        most = float(f"{friction['quantiles'][0]['value']:.2g}")
        assert f"up to {most:g} N·m in 99.73 %" in said


def test_a_saved_study_says_the_same_digits_and_overwrites_nothing(script, desk):
    design = {"zones": {"housing": 22.22225, "shaft": 41.7}, "settings": {"shim [mm]": 0.0123}}
    found = ask(desk, "units", design=design, units=1024)
    cost = ask(desk, "design", design=design)["cost"]
    said = ask(desk, "save", design=design, name="tighter")
    assert {path.name for path in script.parent.iterdir()} >= {"tighter.py", "tighter.tolerances.csv", "fit.py"}
    saved = script.parent / said["script"]
    assert tolalloc("check", saved).returncode == 0
    again = desk_of(saved)
    assert ask(again, "units", design={}, units=1024) == found
    # a table writes a cost to 12 decimals
    assert ask(again, "design", design={})["cost"] == pytest.approx(cost, abs=1e-11)
    answer = load_study(saved).ask(ta.Difference(zones={"shaft": 41.7}, units=1024)).result
    compared(answer, found)
    before = saved.read_bytes()
    with pytest.raises(InputError, match="already"):
        ask(desk, "save", design={}, name="tighter")
    for name in ("../out", "a/b", "", "x" * 61, "1st", ".py", "a.b", None, 3, "con\0", "numpy", "json", "tolalloc"):
        with pytest.raises(InputError, match="name is"):
            ask(desk, "save", design={}, name=name)
    assert saved.read_bytes() == before


def test_a_study_is_saved_beside_a_script_of_any_name(script):
    named = script.rename(script.with_name("my-fit 2.py"))
    said = ask(desk_of(named), "save", design={"zones": {"shaft": 41.7}}, name="tighter")
    assert load_study(script.parent / said["script"]).drawing.sources[1].zone == pytest.approx(41.7e-6)


def test_own_labels_and_drawing_numbers_stand_beside_the_ids(tmp_path):
    script = tmp_path / "own.py"
    row = '{"id": "housing", '
    script.write_text(STUDY.replace(row, f'{row}"label": "Gehäuse", "drawing": "A-7", '), encoding="utf-8")
    told = {own["name"]: own["label"] for own in ask(desk_of(script), "study")["sources"]}
    assert told == {"housing": "Gehäuse, A-7", "shaft": ""}


def test_a_zone_beyond_its_range_is_saved_with_a_wider_one(script, desk):
    found = ask(desk, "units", design={"zones": {"shaft": 150.0}}, units=256)
    saved = script.parent / ask(desk, "save", design={"zones": {"shaft": 150.0}}, name="loose")["script"]
    assert ask(desk_of(saved), "units", design={}, units=256) == found
    assert load_study(saved).drawing.sources[1].maximum == pytest.approx(150e-6)
    with pytest.raises(InputError, match="µm"):
        ask(desk, "save", design={"zones": {"housing": 3e6}}, name="broken")
    assert not (script.parent / "broken.py").exists()
    assert not (script.parent / "broken.tolerances.csv").exists()


@pytest.mark.slow
def test_an_allocation_leaves_locked_sources_alone_and_can_be_stopped(desk):
    start = {"zones": {"housing": 16.0, "shaft": 16.0}}
    state = ask(desk, "ask", question="allocation", design=start, locked=["shaft"])
    while not (state["answer"] or state["error"]):
        state = ask(desk, "state")
    assert state["error"] == ""
    assert state["most"] > 0
    assert state["answer"]["zones"].get("shaft", 16.0) == pytest.approx(16.0)
    assert state["answer"]["zones"]["housing"] != pytest.approx(16.0)
    state = ask(desk, "ask", question="ranking", design=start)
    while not (state["answer"] or state["error"]):
        state = ask(desk, "state")
    assert set(state["answer"]["shares"]) == {"housing", "shaft"}
    assert sum(state["answer"]["shares"].values()) == pytest.approx(100.0, abs=5.0)
    ask(desk, "ask", question="allocation", design={"zones": {"housing": 17.0}})
    ask(desk, "stop")
    state = ask(desk, "state")
    while not (state["answer"] or state["error"]):
        state = ask(desk, "state")
    assert state["error"] == "stopped"


@pytest.mark.parametrize(
    ("name", "sent"),
    [
        ("delete", {}),
        ("design", {"design": {"zones": {"nut": 3.0}}}),
        ("design", {"design": {"zones": {"shaft": -3.0}}}),
        ("design", {"design": {"zones": {"shaft": "3"}}}),
        ("design", {"design": {"zones": {"shaft": 1e-5}}}),
        ("design", {"design": {"zones": {"shaft": 10**400}}}),
        ("design", {"design": {"zones": [3]}}),
        ("design", {"design": {"settings": {"torque": 1.0}}}),
        ("design", {"design": [1]}),
        ("design", {"design": {}, "unit": 6145}),
        ("design", {"design": {}, "unit": True}),
        ("design", {"design": {}, "turn": "1"}),
        ("design", {"design": {}, "tab": "x" * 41}),
        ("units", {"units": 10**9}),
        ("units", {"units": 256.0}),
        ("sweep", {"design": {}, "source": "nut"}),
        ("sweep", {"design": {}, "source": ["shaft"]}),
        ("ask", {"question": "everything"}),
        ("ask", {"question": "allocation", "locked": [["shaft"]]}),
    ],
)
def test_a_request_that_is_none_is_refused_in_a_sentence(desk, name, sent):
    with pytest.raises((InputError, UnknownNameError)) as refusal:
        ask(desk, name, **sent)
    assert len(str(refusal.value).splitlines()) == 1


@pytest.fixture
def server(desk):
    live = LiveServer(desk=desk)
    thread = threading.Thread(target=live.http.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    yield live
    live.http.shutdown()
    live.http.server_close()


def send(live: LiveServer, path: str = "/api/study", body: object = b"{}", method: str = "POST", **headers):
    """Return status and text of a request as the page sends it, with some headers changed; None leaves one out."""
    sent = {"Host": live.host, "X-Token": live.token, "Content-Type": "application/json"}
    sent |= {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", live.http.server_port, timeout=10)
    try:
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        if "Content-Length" not in sent:
            sent["Content-Length"] = str(len(body))
        for name, value in sent.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def test_the_page_and_its_modules_are_served_with_a_token(server):
    status, page = send(server, f"/?token={server.token}", b"", "GET")
    assert status == 200
    for name in ("live.js", "live.css", "page.css"):
        assert f"/{name}" in page
        assert send(server, f"/{name}", b"", "GET")[0] == 200
    assert "http" not in page.replace("http-equiv", "")  # nothing is fetched from elsewhere
    assert json.loads(send(server)[1])["name"] == "fit"


HOSTILE = [
    (403, {"X_Token": None}),
    (403, {"X_Token": "guess"}),
    (403, {"X_Token": "ä"}),
    (403, {"Origin": "http://evil.example"}),
    (403, {"Origin": "null"}),
    (403, {"Origin": "https://127.0.0.1"}),
    (403, {"Host": "evil.example"}),
    (403, {"Host": None}),
    (400, {"body": b"{"}),
    (400, {"body": b"[]"}),
    (400, {"body": b"\xff\xfe"}),
    (400, {"body": b'{"design": NaN}'}),
    (400, {"body": b'{"a": ' + b"[" * 30000 + b"]" * 30000 + b"}"}),
    (400, {"body": b'{"a": ' + b"9" * 5000 + b"}"}),
    (400, {"path": "/api/../../etc/passwd"}),
    (400, {"path": "/etc/passwd"}),
    (413, {"Content_Length": str(LARGEST + 1)}),
    (413, {"Content_Length": "9" * 5000}),
    (413, {"Content_Length": "-1"}),
    (413, {"Content_Length": None}),
    (404, {"method": "GET", "path": "/../fit.py"}),
    (404, {"method": "GET", "path": "/%2e%2e/fit.py"}),
    (404, {"method": "GET", "path": "//etc/passwd"}),
    (404, {"method": "GET", "path": "/live/server.py"}),
    (404, {"method": "GET", "path": "http://["}),
    (404, {"method": "GET", "path": "http://evil.example/"}),
    (403, {"method": "GET", "path": "/"}),
    (403, {"method": "GET", "path": "/?token=guess"}),
    (403, {"method": "GET", "path": "/", "Host": "evil.example"}),
    (501, {"method": "PUT"}),
    (501, {"method": "OPTIONS", "Origin": "http://evil.example"}),
]


@pytest.mark.parametrize(("status", "request_"), HOSTILE)
def test_a_hostile_request_is_refused_and_the_study_is_unharmed(server, script, capfd, status, request_):
    before = {path.name: path.read_bytes() for path in script.parent.iterdir() if path.is_file()}
    found, text = send(server, **request_)
    assert found == status
    assert "Traceback" not in text + capfd.readouterr().err
    assert {path.name: path.read_bytes() for path in script.parent.iterdir() if path.is_file()} == before
    assert send(server)[0] == 200


@pytest.fixture
def many_files():
    """Room for the connections of both sides where a shell leaves little."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4096)), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.slow
@pytest.mark.usefixtures("many_files")
def test_a_thousand_connections_are_bounded_and_leave_room_again(server):
    before = threading.active_count()
    held = [socket.create_connection(("127.0.0.1", server.http.server_port), timeout=10) for _ in range(1000)]
    closed = sum(_is_closed(own) for own in held)
    assert closed >= 1000 - MOST_CONNECTIONS
    assert threading.active_count() <= before + MOST_CONNECTIONS
    for own in held:
        own.close()
    for _ in range(100):
        try:
            if send(server)[0] == 200:
                return
        except OSError:
            threading.Event().wait(0.02)
    raise AssertionError("no room again")


def _is_closed(own: socket.socket) -> bool:
    own.settimeout(0.02)
    try:
        return own.recv(1) == b""
    except TimeoutError:
        return False
    except OSError:
        return True


def _drip(server, begin: bytes, until: threading.Event) -> None:
    """Send a byte at a time on as many connections as there are, each sooner than any byte is waited for."""
    place = ("127.0.0.1", server.http.server_port)
    held = [socket.create_connection(place, timeout=10) for _ in range(MOST_CONNECTIONS)]
    for own in held:
        own.sendall(begin)
    while not until.wait(0.05):
        for own in held:
            with contextlib.suppress(OSError):
                own.sendall(b"a")
    for own in held:
        own.close()


@pytest.mark.parametrize(
    "begin",
    [
        b"",
        b"GET /",
        b"GET / HTTP/1.1\r\nX-Drip: ",
        b"GET / HTTP/1.1\r\nHost: HOST\r\nX-Drip: ",
        b"POST /api/study HTTP/1.1\r\nHost: HOST\r\nX-Token: TOKEN\r\nContent-Length: 60000\r\n\r\n",
    ],
    ids=["nothing", "path", "header", "second header", "body"],
)
def test_connections_that_drip_do_not_keep_the_page_away(server, monkeypatch, begin):
    monkeypatch.setattr("tolalloc.cli.live.server.PATIENCE", 0.5)
    until, said = threading.Event(), begin.replace(b"HOST", server.host.encode())
    said = said.replace(b"TOKEN", server.token.encode())
    dripping = threading.Thread(target=_drip, args=(server, said, until))
    dripping.start()
    try:
        time.sleep(1.0)
        assert send(server)[0] == 200
    finally:
        until.set()
        dripping.join()


def test_a_request_in_pieces_and_a_later_one_on_the_same_connection_are_answered(server, monkeypatch):
    monkeypatch.setattr("tolalloc.cli.live.server.PATIENCE", 0.8)
    with socket.create_connection(("127.0.0.1", server.http.server_port), timeout=10) as own:
        for _ in range(3):  # together longer than one request may take
            for piece in (b"GET /live.css HTTP/1.1\r\n", b"Host: ", server.host.encode(), b"\r\n\r\n"):
                own.sendall(piece)
                time.sleep(0.1)
            answer = http.client.HTTPResponse(own)
            answer.begin()
            assert answer.status == 200 and answer.read()


def test_the_program_that_fails_says_so_and_goes_on(server, monkeypatch):
    monkeypatch.setattr(server.http, "handle_error", lambda *_: None)
    monkeypatch.setattr(Session, "priced", lambda *_: 1 / 0)
    status, text = send(server, "/api/design", b'{"tab": "a", "turn": 1, "design": {}}')
    assert status == 500
    assert "program failed" in json.loads(text)["error"]
    assert send(server)[0] == 200


def test_a_server_started_again_stands_where_it_was(script):
    first = Address(port=8123, token=Address.of(script).token)
    first.keep(script)
    assert Address.of(script) == first
    kept = next((script.parent / ".tolalloc-live").iterdir())
    assert kept.stat().st_mode & 0o077 == 0
    for text in ("", "{", "[]", '{"port": 0, "token": "x"}', json.dumps({"port": 80, "token": "../x"})):
        kept.write_text(text)
        assert Address.of(script).port == 0


@pytest.mark.slow
def test_ctrl_c_ends_the_command_with_a_sentence(script):
    def heeds_ctrl_c():  # which what is started in the background of a script does not
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    kept = {"cwd": ROOT, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command("open", script, "--no-browser"), preexec_fn=heeds_ctrl_c, **kept) as process:
        try:
            assert process.stdout.readline().startswith("Open http://127.0.0.1:")
            time.sleep(0.1)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=20)
        finally:
            process.kill()
    assert process.returncode == 0
    assert said.strip().endswith("The page is closed. What you saved is in the folder of the study.")
    assert "Traceback" not in said


def test_a_question_that_fails_says_so(desk, monkeypatch):
    monkeypatch.setattr(threading, "excepthook", lambda *_: None)
    monkeypatch.setattr(ta.Study, "ask", lambda *_: 1 / 0)
    state = ask(desk, "ask", question="ranking", design={})
    while not state["error"]:
        state = ask(desk, "state")
    assert "program failed" in state["error"]


def test_bad_input_of_the_command_is_one_sentence(tmp_path, script):
    for words in (("open", tmp_path / "none.py"), ("open", script, "--port", "99999999")):
        found = tolalloc(*words, "--no-browser")
        assert found.returncode == 2
        assert found.stderr.strip().splitlines()[-1].startswith("Error: ")
        assert "Traceback" not in found.stderr
