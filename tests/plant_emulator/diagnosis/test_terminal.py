"""The answer on one screen of 80 by 24."""

import pytest

from plant_emulator.diagnosis.report import terminal
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.diagnosis.wording import number, percent, value_with_error
from tests.plant_emulator.diagnosis import answers


def lines(answer):
    return terminal.lines(from_json(answer))


every_kind = pytest.mark.parametrize("kind", answers.KINDS)


@every_kind
def test_answer_fits_a_screen_and_leaves_a_line_for_the_prompt(kind):
    rows = lines(answers.KINDS[kind]())
    assert len(rows) <= 23
    assert max(map(len, rows)) <= 80


def test_answer_of_far_too_much_still_fits():
    answer = answers.two_effects()
    answer["verdict"]["statement"] *= 9
    answer["verdict"]["next_experiment"] *= 9
    answer["verdict"]["parameters"] *= 9
    answer["undetectable"] *= 9
    entry = answer["ranking"][0]
    answer["ranking"] = [
        {**entry, "effect": f"{'long_' * 9}{k}", "parameters": entry["parameters"] * 9}
        for k in range(4)
    ] + answer["ranking"][2:] * 9
    rows = lines(answer)
    assert len(rows) <= 23
    assert max(map(len, rows)) <= 80


@every_kind
def test_answer_is_plain_text_whatever_the_names_hold(kind):
    answer = answers.KINDS[kind]()
    answer["verdict"]["statement"] += "\x1b[31m\x07\r\n\u202e"
    answer["undetectable"] = [{"effect": "a\x1b]0;b", "reason": "c\x00d"}]
    assert all(row.isprintable() for row in lines(answer))


def test_longest_answer_keeps_verdict_place_ranking_shrinkage_and_what_is_next():
    text = "\n".join(lines(answers.two_effects()))
    for told in (
        "EFFECT FOUND, confidence 98 %, 2 logs fitted, 1 log held out",
        "Two effects are needed",
        "where    gear (81 % of the residual), armature current in field weakening",
        "* gear_oil_temperature           812.4   71 %  0.02134 +- 0.00041 1/K",
        "* torque_sensor_lag              214.2   18 %  0.1013 +- 0.0024 s",
        "class  not separable from shaft_damping; drum_speed_lag",
        "closed: 98 % (95 % interval 96 % to 99 %)",
        "drum_inertia 312.7 -> 340.1 +- 1.2 kg m^2; and 2 more",
        "next     drive program1 in reverse",
    ):
        assert told in text


def test_statement_of_two_effects_is_whole_where_no_class_needs_its_line():
    answer = answers.two_effects()
    answer["verdict"] |= {"class": [], "statement": 39 * "seven. " + "end"}  # 276 of 4 * 80
    rows = lines(answer)
    assert [row for row in rows if row.endswith("end")]
    assert len(rows) <= 23


def test_shrinkage_is_the_rms_over_the_channels_in_the_noise():
    rows = {row[:12].strip(): row for row in lines(answers.effect())}
    # sqrt(mean((61/8)^2, (44/5)^2, (41/3)^2, (52/12)^2)) = 9.23, and 1.09, by hand
    assert rows["nominal"].split()[1] == "9.23"
    assert rows["explained"].split()[1] == "1.09"
    assert rows["nominal"].split()[3:] == ["0.41", "%", "0.52", "%", "6.10", "%", "4.40", "%"]
    bars = {key: rows[key].count("#") for key in ("nominal", "recalibrated", "explained")}
    # 5.08 / 9.23 and 1.09 / 9.23 of the longest
    assert bars == {"nominal": 24, "recalibrated": 13, "explained": 3}


def test_answer_without_a_gap_says_so_and_invents_nothing():
    rows = lines(answers.none())
    assert rows[0].startswith("NO GAP BEYOND THE NOISE")
    assert not [row for row in rows if row.startswith(("where", "closed", "deviates", "next"))]


def test_unconverged_answer_shows_its_statement_and_no_confidence():
    answer = answers.unknown()
    answer["verdict"]["statement"] = "The fit did not converge: log more than one run."
    rows = lines(answer)
    assert rows[0] == "CAUSE UNKNOWN, 2 logs fitted, 1 log held out"
    assert rows[1] == "The fit did not converge: log more than one run."
    assert any("12.00 +- not known N m" in row for row in rows)


def test_no_line_ends_between_a_number_and_its_unit():
    answer = answers.effect()
    for more in range(40):
        answer["verdict"]["statement"] = f"{'x' * (40 + more)} 2.83 N m, 312.7 kg m^2 and 98 %."
        told = lines(answer)[1:3]
        assert not [row for row in told if row.endswith(("2.83", "N", "312.7", "kg", "98"))]


def test_effect_without_evidence_is_no_runner_up():
    answer = answers.effect()
    for entry in answer["ranking"]:
        if entry["effect"] == "armature_reaction":
            entry["evidence"] = 0.04
    assert not [row for row in lines(answer) if row.startswith("  armature_reaction")]
    assert [row for row in lines(answer) if row.startswith("  stribeck")]


def test_ranking_without_evidence_has_no_head():
    answer = answers.none()
    answer["ranking"] = [answers.ranked("stribeck", "gear", 0.01)]
    assert not [row for row in lines(answer) if row.split()[:1] == ["effect"]]


def test_runners_up_give_way_to_the_lines_between_the_sections():
    answer = answers.effect()
    answer["verdict"]["next_experiment"] = None
    rows = lines(answer)
    # four others have evidence; 23 lines hold two of them and three empty ones
    assert (len(rows), rows.count("")) == (23, 3)
    assert [row.split()[0] for row in rows if row.startswith("  ") and row[2].isalpha()] == [
        "effect",
        "with",
        "class",
        "stribeck",
        "load_dependent_gear_loss",
    ]


def test_effects_that_do_not_show_are_all_named_where_their_reasons_have_no_room():
    answer = answers.effect()
    names = [f"effect_number_{k}" for k in range(5)]
    answer["undetectable"] = [{"effect": name, "reason": "too small " * 9} for name in names]
    told = "\n".join(lines(answer))
    assert all(name in told for name in names)
    assert "too small" not in told


def test_parameter_deviations_are_counted_where_the_first_has_no_room():
    answer = answers.effect()
    long = answers.INERTIA | {"name": "gear_viscous_friction", "unit": "N m (s/rad)^delta_g"}
    answer["verdict"]["parameters"] = [long, *[answers.INERTIA] * 4]
    (row,) = [row for row in lines(answer) if row.startswith("deviates")]
    assert row == "deviates gear_viscous_friction; drum_inertia; drum_inertia; and 2 more"


def test_a_single_log_is_told_as_one():
    answer = answers.KINDS["effect"]()
    answer["logs"] = {"estimation": ["run.csv"], "held_out": ["run.csv"]}
    told = lines(answer)[0]
    assert "1 log, its last part held out" in told


def test_logs_held_out_in_turn_are_told_as_such():
    answer = answers.effect()
    logs = ["a.csv", "b.csv", "c.csv"]
    answer["logs"] = {"estimation": logs, "held_out": logs}
    expected = "EFFECT FOUND, confidence 98 %, 3 logs, each held out in turn"
    assert lines(answer)[0] == expected


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (340.1234, 1.234, "340.1 +- 1.2"),
        (0.021337, 0.000412, "0.02134 +- 0.00041"),
        (312.0, 45.0, "312 +- 45"),
        (123456789.0, 1234567.0, "(1.235 +- 0.012)e8"),
        (2.5e-6, 3e-7, "(2.50 +- 0.30)e-6"),
        (12.0, None, "12.00 +- not known"),
        (None, 1.0, "not known"),
        (0.0, 0.02, "0.000 +- 0.020"),
        (1.0, 0.0996, "1.00 +- 0.10"),
    ],
)
def test_value_is_written_to_the_second_digit_of_its_error(value, error, text):
    assert value_with_error(value, error) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (9.999, "10.0"), (1234.5, "1234"), (1e7, "1.00e+07"), (float("nan"), "not known")],
)
def test_number_has_three_digits(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.98, "98 %"),
        (0.998, "99.8 %"),
        (1.0, "100 %"),
        (0.004, "0.4 %"),
        (-0.02, "-2 %"),
        (1.5e-14, "0 %"),
        (-1e-4, "0 %"),
        (0.9998, "100 %"),
    ],
)
def test_share_near_the_ends_shows_a_decimal(share, text):
    assert percent(share) == text


def test_advice_for_two_alternatives_is_told_whole():
    answer = answers.two_effects()
    answer["verdict"]["next_experiment"] = (
        "Drive program4 (60 s, to 350 rad/s, with sweeps): there drum_speed_scale differs from "
        "motor_speed_scale by 20 and from drum_speed_lag by 497 times the noise."
    )
    told = " ".join(" ".join(lines(answer)).split())
    assert answer["verdict"]["next_experiment"] in told


def test_draft_says_its_law_what_it_closes_and_the_alternative():
    rows = lines(answers.drafted())
    k = next(k for k, row in enumerate(rows) if row.startswith("draft "))
    told = " ".join(" ".join(rows[k : k + 3]).split())
    assert "friction of the gear at its output: -31.4 exp(-(w/0.5)^2) N m" in told
    assert "closes 81 % (77 % to 84 %) of the held-out gap; at most 93 %" in told
    assert "alternatives -8.2 sqrt(w) N m; file drafts/draft_gear_1.py" in told


def test_no_draft_is_told_only_where_one_was_asked_for():
    asked = {**answers.unknown(), "drafts": []}
    assert any(row.startswith("draft ") for row in lines(asked))
    assert not any(row.startswith("draft ") for row in lines(answers.unknown()))
