"""What `check` says of a configuration: every rule at its edge."""

import json
from dataclasses import replace

import pytest

import gateway
from gateway.cli import main
from gateway.config_file import load
from gateway.configuration.config import Config, from_document
from gateway.link.device import Device
from gateway.review.loop import rho_of
from gateway.review.review import review
from plant_emulator.emulator.process import EmulatorProcess
from register_maps import load as load_map

MAP = load_map("bench_int16")
RHO_ONE = 312.71242 / 0.645**2


def found(where, what="", **values):
    """Severities of the findings at a place, for a configuration with `section__key=value`."""
    names = {name.replace("__", "."): str(value) for name, value in values.items()}
    findings = review(Config().with_values(names), MAP).findings
    return [one.severity for one in findings if one.where == where and what in one.what]


def test_the_default_configuration_holds_without_a_warning():
    found = review(Config(), MAP)
    assert found.holds
    assert {one.severity for one in found.findings} == {"info"}


def test_rho_of_the_forklift_is_the_share_of_drum_and_gear_in_its_mass():
    assert rho_of(Config()) == pytest.approx(0.207, abs=0.001)


@pytest.mark.parametrize(
    ("rho", "severity"),
    [(0.49, "info"), (0.51, "warning"), (0.89, "warning"), (0.91, "error"), (1.5, "error")],
)
def test_rho_is_warned_of_from_one_half_and_refused_from_nine_tenths(rho, severity):
    mass = RHO_ONE / rho
    assert found("truck.mass_kg", "rho", truck__mass_kg=mass) == [severity]


@pytest.mark.parametrize("torque", ["integrated", "averaged"])
def test_a_pallet_truck_is_let_through_with_one_window_matched_filters_and_no_lead(torque):
    values = {"truck__mass_kg": 500, "regulator__lead_s": 0, "regulator__torque": torque}
    assert found("truck.mass_kg", "rho", **values) == ["warning"]
    matched = values | {"bench__torque_filter_ms": 20, "bench__speed_filter_ms": 20}
    assert found("truck.mass_kg", "rho", **matched) == ["warning"]


@pytest.mark.parametrize(
    "spoilt",
    [
        {"regulator__lead_s": 0.085},
        {"regulator__torque": "instantaneous"},
        {"regulator__torque": "averaged", "loop__period_ms": 20},
        {"bench__torque_filter_ms": 20},
        {"bench__speed_filter_ms": 20},
    ],
)
def test_a_pallet_truck_is_refused_without_any_of_them(spoilt):
    values = {"truck__mass_kg": 500, "regulator__lead_s": 0} | spoilt
    assert found("truck.mass_kg", "rho", **values) == ["error"]


def test_the_thesis_regulator_has_no_lead_that_could_matter():
    values = {"truck__mass_kg": 500, "regulator__name": "thesis", "regulator__lead_s": 0.085}
    assert found("truck.mass_kg", "rho", **values) == ["warning"]


def test_a_mass_below_what_the_sampled_loop_bears_is_refused():
    values = {"regulator__torque": "instantaneous", "regulator__trim": 0, "loop__period_ms": 50}
    assert found("truck.mass_kg", "smallest", truck__mass_kg=500, **values) == ["error"]
    assert found("truck.mass_kg", "smallest", truck__mass_kg=1000, **values) == ["info"]


def test_a_trim_that_is_too_high_is_refused():
    assert found("truck.mass_kg", "smallest", regulator__trim=1.5) == ["error"]


def test_lead_with_filters_that_differ_is_warned_of():
    assert "warning" in found("regulator.lead_s", truck__mass_kg=1500, bench__speed_filter_ms=50)


@pytest.mark.parametrize(
    ("torque", "period", "severities"),
    [
        ("integrated", 50, []),
        ("averaged", 10, []),
        ("averaged", 20, ["warning"]),
        ("instantaneous", 10, ["warning"]),
    ],
)
def test_torque_that_does_not_span_the_window_is_warned_of(torque, period, severities):
    values = {"regulator__torque": torque, "loop__period_ms": period}
    assert found("regulator.torque", **values) == severities


@pytest.mark.parametrize(
    ("where", "values", "severity"),
    [
        ("loop.period_ms", {"loop__period_ms": 50}, []),
        ("loop.period_ms", {"loop__period_ms": 51}, ["error"]),
        ("plc.timeout_ms", {"plc__timeout_ms": 50}, []),
        ("plc.timeout_ms", {"plc__timeout_ms": 51}, ["error"]),
        ("loop.stale_ms", {"loop__stale_ms": 140}, []),
        ("loop.stale_ms", {"loop__stale_ms": 141}, ["warning"]),
        ("limits.watchdog_ms", {"limits__watchdog_ms": 100}, []),
        ("limits.watchdog_ms", {"limits__watchdog_ms": 99}, ["warning"]),
        ("limits.watchdog_ms", {"limits__watchdog_ms": 90, "loop__period_ms": 50}, ["error"]),
    ],
)
def test_times_have_to_fit_into_each_other(where, values, severity):
    assert found(where, **values)[:1] == severity


def test_delay_beyond_the_response_of_a_dynamometer_is_warned_of():
    # 64 + 9.5 + 10 + 5 = 88 ms; 80 + 9.5 + 10 + 5 = 104 ms
    assert found("bench.dead_time_ms") == ["info"]
    assert found("bench.dead_time_ms", bench__dead_time_ms=80) == ["warning"]


def test_poll_faster_than_the_scan_is_warned_of():
    assert found("loop.period_ms", loop__period_ms=10) == []
    assert found("loop.period_ms", loop__period_ms=5) == ["warning"]


@pytest.mark.parametrize(
    ("where", "values"),
    [
        ("limits.speed_max_rpm", {"limits__speed_max_rpm": 3600}),
        ("limits.rate_up_rpm_s", {"limits__rate_up_rpm_s": 600}),
        ("limits.rate_down_rpm_s", {"limits__rate_down_rpm_s": 970}),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 80}),
    ],
)
def test_a_limit_that_the_cycle_would_meet_is_refused(where, values):
    """14 km/h are 3604 rpm; 0.65 and 1.05 m/s2 are 602 and 973 rpm/s; 83.5 ms late are 81 rpm."""
    assert found(where, **values) == ["error"]
    assert found(where) == ["info"]


def test_torque_limit_at_14_km_h_is_that_of_e24():
    limits = [one for one in review(Config(), MAP).findings if one.where == "truck.braking_m_s2"]
    assert limits[0].allowed == "<= 4289"


def test_torque_limit_below_base_speed_is_that_of_e24():
    slow = Config().with_values({"truck.top_speed_km_h": "5"})
    limits = [one for one in review(slow, MAP).findings if one.where == "truck.braking_m_s2"]
    assert limits[0].allowed == "<= 8341"


def test_a_braking_that_the_motor_cannot_hold_is_warned_of():
    assert found("truck.braking_m_s2", truck__braking_m_s2=2.5) == ["warning"]


@pytest.mark.parametrize(
    ("where", "values", "severity"),
    [
        ("limits.overspeed_rpm", {"limits__overspeed_rpm": 4830}, ["error"]),
        ("limits.overspeed_rpm", {"limits__overspeed_rpm": 4831}, ["warning"]),
        ("limits.overspeed_rpm", {"limits__overspeed_rpm": 4879}, []),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 1207}, []),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 1208}, ["warning"]),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 2414}, ["warning"]),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 2416}, ["error"]),
        ("limits.deviation_rpm", {"limits__deviation_rpm": 4830}, ["error"]),
        ("limits.rate_up_rpm_s", {"limits__rate_up_rpm_s": 15900}, []),
        ("limits.rate_up_rpm_s", {"limits__rate_up_rpm_s": 16000}, ["warning"]),
        ("limits.rate_up_rpm_s", {"limits__rate_up_rpm_s": 24000}, ["error"]),
        ("limits.rate_down_rpm_s", {"limits__rate_down_rpm_s": 15900}, []),
        ("limits.rate_down_rpm_s", {"limits__rate_down_rpm_s": 30000}, ["warning"]),
        ("loop.overruns", {"loop__overruns": 20}, []),
        ("loop.overruns", {"loop__overruns": 21}, ["warning"]),
        ("loop.overruns", {"loop__overruns": 100}, ["warning"]),
        ("loop.overruns", {"loop__overruns": 101}, ["error"]),
        ("loop.overruns", {"loop__overruns": 15, "loop__period_ms": 20}, ["warning"]),
        ("bench.drum_inertia_kg_m2", {"bench__drum_inertia_kg_m2": 20}, ["warning"]),
        ("bench.drum_inertia_kg_m2", {"bench__drum_inertia_kg_m2": 21}, []),
        ("bench.drum_inertia_kg_m2", {"bench__drum_inertia_kg_m2": 9000}, ["warning"]),
    ],
)
def test_limits_have_to_fit_each_other_and_the_bench(where, values, severity):
    """4830 rpm and 1 % are 4878; 62.6^2 x 1.8506 x 72 / 312.71 rad/s2 are 15945 rpm/s at most;
    the watchdog is 200 ms; 50 kg and 20 t at the rim of 0.645 m are 20.8 and 8321 kg m2."""
    held = "against the limit"
    findings = review(
        Config().with_values({k.replace("__", "."): str(v) for k, v in values.items()}), MAP
    ).findings
    assert [
        one.severity for one in findings if one.where == where and held not in one.what
    ] == severity


@pytest.mark.parametrize(
    ("lead", "severity"), [(0.132, []), (0.134, ["warning"]), (0.27, ["error"]), (1.0, ["error"])]
)
def test_lead_may_not_go_far_beyond_the_delay(lead, severity):
    """The delay is 88.5 ms: 133 ms are warned of, 265 ms refused."""
    assert found("regulator.lead_s", "delay", regulator__lead_s=lead) == severity
    thesis = {"regulator__lead_s": lead, "regulator__name": "thesis"}
    assert found("regulator.lead_s", "delay", **thesis) == []


def with_range(signal, low, high, **changes):
    """The shipped map with another range of one register."""
    return replace(
        MAP,
        registers=tuple(
            replace(one, range=(low, high), **changes) if one.signal == signal else one
            for one in MAP.registers
        ),
    )


@pytest.mark.parametrize(
    ("signal", "low", "high", "needs", "key"),
    [
        ("speed_setpoint", 0, 1000, "4830 rpm", "limits.speed_max_rpm"),
        ("speed_setpoint", 10, 4830, "0 rpm", "limits.speed_max_rpm"),
        ("speed_rate", -3000, 2999, "3000 rpm/s", "limits.rate_up_rpm_s"),
        ("speed_rate", 0, 3000, "-3000 rpm/s", "limits.rate_down_rpm_s"),
        ("ramp_limit", 1, 2000, "3000 rpm/s", "rates"),
        ("current_limit", 0, 50, "72 A", "limits.current_limit_A"),
        ("watchdog_timeout", 50, 150, "200 ms", "limits.watchdog_ms"),
        ("mode", 1, 3, "4 1", "the run"),
        ("control", 0, 0, "1 1", "the start"),
        ("map_version", 2, 3, "1", "version"),
    ],
)
def test_a_map_that_cannot_hold_what_the_limits_allow_is_refused(signal, low, high, needs, key):
    findings = review(Config(), with_range(signal, low, high)).errors
    assert findings
    assert {one.where for one in findings} == {"plc.map"}
    assert needs in [one.value for one in findings]
    assert MAP.register(signal).name in findings[0].what
    assert key in findings[0].what
    assert f"{low:g}" in findings[0].allowed
    assert f"{high:g}" in findings[0].allowed


@pytest.mark.parametrize("signal", ["command_sequence", "gateway_heartbeat"])
def test_a_count_of_commands_that_ends_is_refused(signal):
    findings = review(Config(), with_range(signal, 0, 1000, wraps=False)).errors
    assert [MAP.register(signal).name in one.what for one in findings] == [True]


def test_a_count_of_commands_may_start_again_early():
    assert not review(Config(), with_range("gateway_heartbeat", 0, 1000)).errors


def test_a_narrow_map_holds_for_narrow_limits():
    slow = {
        "limits.speed_max_rpm": "1000",
        "limits.deviation_rpm": "200",
        "limits.overspeed_rpm": "1100",
        "truck.top_speed_km_h": "3",
    }
    assert review(Config().with_values(slow), with_range("speed_setpoint", 0, 1000)).holds


def test_a_map_without_a_register_is_asked_nothing_of_it():
    kept = tuple(one for one in MAP.registers if one.signal != "speed_rate")
    assert review(Config(), replace(MAP, registers=kept)).holds


def test_a_sweep_needs_the_mode_of_speed():
    sweep = from_document({"sweep": {"speeds_rpm": [1000.0], "hold_s": 5.0, "rate_rpm_s": 200.0}})
    only_road_load = with_range("mode", 4, 5)
    values = [one.value for one in review(sweep, only_road_load).findings if one.where == "plc.map"]
    assert values == ["1 1", "3 1"]


def answer(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["check", *arguments])
    return ended.value.code or 0, capsys.readouterr()


@pytest.fixture
def file(tmp_path):
    written = tmp_path / "bench.toml"
    written.write_text("[truck]\nmass_kg = 3640\n", encoding="utf-8")
    assert load(written).truck.mass == 3640.0
    return str(written)


def test_the_command_answers_in_the_form_check_1(capsys, file):
    code, said = answer(capsys, "-c", file, "--json", "-")
    told = json.loads(said.out)
    assert (code, told["schema"], told["holds"]) == (0, "check/1", True)
    assert set(told["findings"][0]) == {"severity", "where", "what", "value", "allowed"}
    assert gateway.check(file).to_json() == told


def test_the_command_exits_with_one_when_it_does_not_hold(capsys, file):
    code, said = answer(capsys, "-c", file, "--set", "truck.mass_kg=500")
    assert code == 1
    assert "does not hold" in said.out


def test_the_command_exits_with_two_on_bad_input(capsys, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text("[truck]\nmas_kg = 3640\n", encoding="utf-8")
    code, said = answer(capsys, "-c", str(bad))
    assert code == 2
    assert "bad.toml:2: [truck] mas_kg" in said.err
    assert said.err.count("\n") == 1


def test_a_plc_that_does_not_answer_does_not_hold(capsys, file):
    code, said = answer(capsys, "-c", file, "--live", "--set", "plc.port=1", "--json", "-")
    assert code == 1
    assert json.loads(said.out)["findings"][0]["where"] == "plc.host"


@pytest.mark.slow
def test_live_compares_the_map_with_the_device(capsys, file):
    with EmulatorProcess() as emulator:
        here = ["-c", file, "--live", "--set", f"plc.port={emulator.port}", "--json", "-"]
        code, _ = answer(capsys, *here)
        assert code == 0
        emulator.set_faults("word_order")
        code, said = answer(capsys, *here)
    worst = json.loads(said.out)["findings"]
    assert code == 1
    assert any(one["where"] == "TEST_U32" and "word order" in one["what"] for one in worst)


@pytest.mark.slow
def test_live_finds_a_command_block_of_another_map_version(capsys, file):
    with EmulatorProcess() as emulator:
        with Device(host="127.0.0.1", port=emulator.port, unit=1, timeout=1.0).link() as link:
            register = MAP.register("map_version")
            link.write(MAP.command.start, other_version(register.address - MAP.command.start))
        here = ["-c", file, "--live", "--set", f"plc.port={emulator.port}", "--json", "-"]
        code, said = answer(capsys, *here)
    told = json.loads(said.out)["findings"][0]
    assert (code, told["where"], told["value"]) == (1, "plc.map", 99.0)


def other_version(place):
    words = [0] * MAP.command.count
    words[place] = 99
    return words


@pytest.mark.parametrize(
    ("signals", "what"),
    [
        (["interlock"], "an open guard"),
        (["alarm"], "no alarm of the PLC"),
        (["command_sequence_echo"], "ignores the commands"),
        (["command_age"], "another master"),
        (["armature_current"], "torque sensor"),
        (["speed_reference"], "ignores the setpoint"),
        (["test_uint32", "test_float32"], "exchanged words"),
    ],
)
def test_protection_that_the_map_lacks_is_a_warning_that_says_what_is_missing(signals, what):
    kept = tuple(one for one in MAP.registers if one.signal not in signals)
    found = review(Config(), replace(MAP, registers=kept))
    warnings = [one for one in found.findings if one.severity == "warning"]
    assert found.holds
    assert warnings
    assert all(what in one.what and signals[0][:4] in one.what for one in warnings)
