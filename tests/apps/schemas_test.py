#!/usr/bin/env python3
"""Validates what the command answers against docs/schemas: every kind of answer and of refusal, and
the project files that it reads and writes. Proves for each that the schema can say no.

usage: schemas_test.py COMMAND SCHEMAS EXAMPLES
"""

import copy
import functools
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import tomllib
import warnings

warnings.simplefilter("ignore", DeprecationWarning)  # RefResolver, which Debian's jsonschema has
import jsonschema

command, schemas, examples = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
failures = []


@functools.cache  # checking a schema itself takes longer than all that is checked by it
def validator(name):
    schema = json.loads((schemas / f"{name}.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    resolver = jsonschema.RefResolver(f"file://{schemas}/", schema)
    return jsonschema.Draft202012Validator(schema, resolver=resolver)


def check(name, document, what):
    for error in validator(name).iter_errors(document):
        failures.append(f"{what}: {error.json_path}: {error.message}")


def check_says_no(name, document, what):
    if validator(name).is_valid(document):
        failures.append(f"{what}: accepted by {name}.schema.json")


def answer(arguments, status, folder):
    done = subprocess.run([command, *arguments, "--json"], cwd=folder, capture_output=True, text=True)
    if done.returncode != status:
        failures.append(f"{arguments}: exit status {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def check_answer(arguments, status, folder, name=None):
    """The answer is as its schema says, and no member of it may be left out or be of another type."""
    name = name or arguments[0]
    document = answer(arguments, status, folder)
    what = " ".join(map(str, arguments))
    check(name, document, what)
    for key in document:
        wrong = copy.deepcopy(document)
        wrong[key] = {"not": "this"} if not isinstance(wrong[key], dict) else "text"
        check_says_no(name, wrong, f"{what} with a wrong {key}")
    return document


PARTS = {
    "flywheel": 'moment_of_inertia = "0.003 kg m^2"',
    "elevator": 'mass = "8 kg"\ndrum_radius = "1 in"',
    "arm": 'moment_of_inertia = "1.1 kg m^2"\nmass = "3 kg"\ncenter_of_mass = "0.4 m"',
    "turret": 'moment_of_inertia = "0.5 kg m^2"',
    "swerve drive": 'mass = "15 kg"\nwheel_radius = "2 in"',
}


def drivetrain(turning):
    """A SysId JSON of a drivetrain: kS 0.6 V, kV 2.4 V s/m, kA 0.4 V s²/m, 0.62 m wide."""
    log = {"sysid": True, "test": "Drivetrain", "units": "Meters", "unitsPerRotation": 0.5}
    for test in ("slow-forward", "slow-backward", "fast-forward", "fast-backward"):
        sign = 1 if test.endswith("forward") else -1
        signs = (-sign if turning else sign, sign)
        way, speed, rows, step = [0.0, 0.0], [0.0, 0.0], [], 0.005
        for i in range(2400 if test.startswith("slow") else 500):
            volts = 0.25 * i * step if test.startswith("slow") else 4.0
            heading = (way[1] - way[0]) / 0.62
            rate = (speed[1] - speed[0]) / 0.62
            rows.append([i * step, signs[0] * volts, signs[1] * volts, way[0] / 0.5, way[1] / 0.5,
                         speed[0] / 0.5, speed[1] / 0.5, heading, rate])
            for side in (0, 1):
                pushed = max(0.0, volts - 0.6) - 2.4 * abs(speed[side])
                way[side] += step * speed[side]
                speed[side] += signs[side] * step * pushed / 0.4
        log[test] = rows
    return log


def check_drivetrain(folder):
    (folder / "straight.json").write_text(json.dumps(drivetrain(False)))
    (folder / "turning.json").write_text(json.dumps(drivetrain(True)))
    both = ["identify", "straight.json", "--also", "turning.json"]
    gains = check_answer(both, 0, folder)["gains"]
    for name, value, tolerance in [("kV", 2.4, 0.01), ("kV_angular", 2.4 * 0.31, 0.01), ("kA", 0.4, 0.05),
                                   ("kS_left", 0.6, 0.05), ("trackwidth", 0.62, 0.005)]:
        if abs(gains[name]["value"] / value - 1) > tolerance:
            failures.append(f"drivetrain: {name} is {gains[name]}, not {value}")
    check_answer(["identify", "straight.json"], 0, folder)
    check_answer(["identify", "turning.json"], 0, folder)
    check_answer(["identify", "straight.json", "turning.json"], 0, folder, "identify_logs")
    check_answer(["tune", "turning.json"], 0, folder)
    drive = check_answer(["tune", "straight.json", "--also", "turning.json"], 0, folder)["drive"]
    if not drive["kP"] <= min(drive[mode]["paste"][0]["kP"] for mode in ("linear", "angular")):
        failures.append(f"drivetrain: kP is {drive['kP']}")
    check_answer(["identify", examples / "logs/elevator.json", "--mechanism", "drivetrain"], 2, folder)


def check_answers(folder):
    log = examples / "logs/elevator.json"
    check_answer(["identify", log], 0, folder)
    (folder / "again.json").write_text(log.read_text())
    check_answer(["identify", log, "again.json"], 0, folder, "identify_logs")
    check_answer(["experiment", log, "--test-time", "30s"], 0, folder)
    check_answer(["experiment", examples / "elevator.toml"], 2, folder)
    check_answer(["tune", log, "--out", "tuned"], 0, folder)
    check("project", tomllib.loads((folder / "tuned/gains.toml").read_text()), "gains.toml")
    for kind, parts in PARTS.items():
        project = folder / f"{kind}.toml"
        project.write_text(f'[mechanism]\ntype = "{kind}"\nmotor = "NEO"\ngearing = 20.0\n{parts}\n')
        check("project", tomllib.loads(project.read_text()), project.name)
        check_answer(["design", project, "--out", kind], 0, folder)
        check_answer(["analyze", project], 0, folder)
        check("project", tomllib.loads((folder / kind / "gains.toml").read_text()), f"{kind} gains")
    # Without kA: a velocity is the input.
    servo = folder / "servo.toml"
    servo.write_text('[mechanism]\ntype = "elevator"\n[gains]\nkV = 4.0\n')
    check_answer(["design", servo], 0, folder)
    for model in ("pendulum", "cart_pole"):
        check("project", tomllib.loads((examples / f"{model}.toml").read_text()), model)
        check_answer(["simulate", examples / f"{model}.toml"], 0, folder)
        check_answer(["analyze", examples / f"{model}.toml"], 0, folder)
        check_answer(["design", examples / f"{model}.toml"], 0, folder, "design_model")
    check_answer(["simulate", examples / "elevator.toml"], 0, folder)
    for name in ("sized_elevator", "sized_arm"):
        check("project", tomllib.loads((examples / f"{name}.toml").read_text()), name)
    check_answer(["size", examples / "sized_elevator.toml", "--compare-motors=false"], 0, folder)
    check_answer(["size", examples / "sized_arm.toml", "--stator-limit", "0.1A"], 1, folder)
    check_answer(["size", examples / "pendulum.toml"], 2, folder)
    for name in ("drive_differential", "drive_swerve"):
        check("project", tomllib.loads((examples / f"{name}.toml").read_text()), name)
    check_answer(["drive", examples / "drive_differential.toml"], 0, folder)
    check_answer(["drive", examples / "drive_differential.toml", "--path-velocity", "40m/s", "--path-acceleration",
                  "90m/s^2", "--path-centripetal", "90m/s^2"], 1, folder)
    check_answer(["drive", examples / "elevator.toml"], 2, folder)
    check_answer(["optimize", examples / "drive_fastest.toml"], 0, folder)
    check_answer(["optimize", examples / "drive_fastest.toml", "--attempts", "0"], 2, folder)
    for follower in ("ramsete", "ltv unicycle", "ltv drive"):
        check_answer(["design", examples / "drive_differential.toml", "--follower", follower], 0, folder, "design_drive")
    check_answer(["design", examples / "drive_swerve.toml"], 0, folder, "design_holonomic")
    check_answer(["design", examples / "drive_swerve.toml", "--follower", "pure pursuit"], 2, folder, "design_holonomic")
    check_answer(["drive", examples / "drive_differential.toml", "--follower", "pure pursuit"], 0, folder)
    check_model_fit(folder)
    (folder / "discrete.json").write_text('{"A":[[0.5]],"B":[[1]],"domain":"discrete","T":0.02}')
    check_answer(["analyze", "discrete.json"], 0, folder)
    for view in ("bode", "nyquist", "nichols", "step", "impulse", "margins", "sisotool"):
        check_answer([view, "2/(s^2+3*s+2)*exp(-0.1*s)", "--gain", "2"], 0, folder, "loop")
    for view in ("bode", "nyquist", "nichols", "step", "impulse", "margins", "sisotool"):
        check_answer([view, "exp(-s)/(s+1) + exp(-0.3*s)/(s+2)"], 0, folder, "loop")
    check_answer(["pidtune", "exp(-0.2*s)/(s+1)^2", "1/(s*(s+1)^2)"], 0, folder, "loop")
    for view in ("rlocus", "sisotool"):
        check_answer([view, "0.1*z^-1/(1-0.9z^-1)", "1/(z-0.5)", "--period", "20ms", "--damping", "0.5"], 0, folder, "loop")
    check("loop", answer(["bode", "1/(s+1"], 2, folder), "bode of what is no expression")


def check_each(folder):
    """A line a log, of a mechanism, a drivetrain and two without gains, and their summary."""
    logs = folder / "each"
    logs.mkdir()
    for name in ("straight.json", "still.json", "again.json"):
        (logs / name).write_text((folder / name).read_text())
    (logs / "none.csv").write_text("nothing")
    arguments = [command, "identify", "each", "--out", "each-gains", "--json"]
    lines = subprocess.run(arguments, cwd=folder, capture_output=True, text=True).stdout.splitlines()
    if len(lines) != 4 or "\n".join(lines) + "\n" != (folder / "each-gains/logs.jsonl").read_text():
        failures.append(f"identify each: {lines}")
    for line in lines:
        row = json.loads(line)
        check("log_row", row, f"identify each: {row['path']}")
        for key in row:
            wrong = copy.deepcopy(row)
            wrong[key] = {"not": "this"} if not isinstance(wrong[key], dict) else "text"
            check_says_no("log_row", wrong, f"a row with a wrong {key}")
    summary = json.loads((folder / "each-gains/result.json").read_text())
    check("identify_each", summary, "identify each")
    for key in summary:
        check_says_no("identify_each", {**summary, key: {"not": "this"}}, f"a summary with a wrong {key}")
    check_answer(["merge", "again.json"], 2, folder, "identify_each")


def check_model_fit(folder):
    """A lag of 0.5 s behind a square wave, its output in mm."""
    rows, x = ["time (s),command,x (mm)"], 0.0
    for k in range(400):
        u = 1.0 if k // 40 % 2 == 0 else -0.5
        rows.append(f"{0.02 * k:.2f},{u},{1000 * x + (-1) ** (k * k // 3):.6f}")
        x += (2.0 * u - x) * (1.0 - math.exp(-0.02 / 0.5))
    (folder / "lag.csv").write_text("\n".join(rows) + "\n")
    (folder / "lag.toml").write_text(
        '[model]\nname = "lag"\nstates = { x = "m" }\ninputs = { u = "1" }\n'
        'parameters = { gain = "1 m", lag = "0.2 s" }\n[model.derivative]\nx = "(gain*u - x)/lag"\n'
        '[fit]\nchannels = { u = "command" }\nto = "6 s"\nvalidation_from = "6 s"\nfree_initial = ["x"]\n'
        'free = { gain = "0 .. 10 m", lag = ">= 1 ms" }\n')
    check("project", tomllib.loads((folder / "lag.toml").read_text()), "lag.toml")
    told = check_answer(["identify", "lag.csv", "lag.toml", "--out", "lag"], 0, folder, "identify_model")
    found = {one["name"]: one["value"] for one in told["parameters"]}
    if abs(found["gain"] - 2.0) > 0.01 or abs(found["lag"] - 0.5) > 0.01:
        failures.append(f"identify lag.csv: {found}")
    check_answer(["identify", "lag.csv", "lag.toml", "--loss", "soft_l1", "--starts", "3"], 0, folder,
                 "identify_model")
    (folder / "wrong_channel.toml").write_text((folder / "lag.toml").read_text().replace('"command"', '"comand"'))
    check_answer(["identify", "lag.csv", "wrong_channel.toml"], 2, folder, "identify_model")
    for name in ("cascaded_tanks", "cascaded_tanks_extended", "silverbox", "wiener_hammerstein",
                 "wiener_hammerstein_linear"):
        check("project", tomllib.loads((examples / f"{name}.toml").read_text()), name)


def check_estimate(folder):
    """The lag of check_model_fit, whose readings err by 1 mm, and one output without a noise."""
    model = (folder / "lag.toml").read_text().split("[fit]")[0].replace('"1 m"', '"2 m"').replace("0.2 s", "0.5 s")
    fit = '[fit]\nchannels = { u = "command" }\n[estimate]\n'
    (folder / "lag_estimate.toml").write_text(
        model + fit + 'process_noise = { x = "1 mm" }\nmeasurement_noise = { x = "1 mm" }\n')
    check("project", tomllib.loads((folder / "lag_estimate.toml").read_text()), "lag_estimate.toml")
    files = ["estimate", "lag.csv", "lag_estimate.toml"]
    for more in ([], ["--filter", "unscented", "--out", "estimate"], ["--tune-noise", "--smoother=false"]):
        check_answer([*files, *more], 0, folder)
    (folder / "lag_silent.toml").write_text(model + fit)
    check_answer(["estimate", "lag.csv", "lag_silent.toml"], 2, folder)


def check_units(folder):
    check_answer(["units"], 0, folder)
    check_answer(["units", "velocity"], 0, folder)
    check_answer(["units", "taste"], 2, folder)


def check_motors(folder):
    check_answer(["motors"], 0, folder)
    check_answer(["motors", "NEO"], 0, folder)
    check_answer(["motors", "nothing"], 2, folder)
    rows = [f"{s},{2.42 * (1 - s / 5310)},{133 - 130.3 * s / 5310}" for s in range(0, 5311, 531)]
    (folder / "cim.csv").write_text("Speed (RPM),Torque (N m),Current (A)\n" + "\n".join(rows))
    rows = [f"{0.1 * k},12.0,2.4,{130 - 0.2 * k}" for k in range(20)]
    (folder / "held.csv").write_text("Time,Volts,Torque (N m),Amps\n" + "\n".join(rows))
    check_answer(["motor-curves", "cim.csv", "held.csv"], 0, folder)
    check_answer(["motor-curves", "cim.csv", "--motor", "nothing"], 2, folder)


def check_plan(folder):
    for space in ("space_elevator_arm.toml", "space_scoring_arm.toml"):
        check_answer(["plan", str(examples / space)], 0, folder)
        check_answer(["plan", str(examples / space), "--traversal", "sequential"], 0, folder)
    check_answer(["plan", str(examples / "space_elevator_arm.toml"), "--goal", "0 deg, 1 m"], 1, folder)
    check_answer(["plan", str(examples / "space_elevator_arm.toml"), "--method", "teleport"], 2, folder)


def check_profile(folder):
    limits = ["profile", "--to", "1.2m", "--velocity", "1.5m/s", "--acceleration", "3m/s^2"]
    check_answer(limits, 0, folder)
    for more in (["--kind", "s-curve"], ["--resonance", "4Hz"], ["--kind", "minimum-jerk"], ["--kv", "4", "--ka", "1"]):
        check_answer([*limits, *more], 0, folder)
    check_answer([*limits, "--kind", "curve"], 2, folder)
    check_answer(["profile", "--to", "1m"], 2, folder)
    axes = examples / "axes.toml"
    check_answer(["profile", axes], 0, folder, "axes")
    check_answer(["profile", axes, "--synchronize", "phase", "--least", "3s"], 0, folder, "axes")
    check_answer(["profile", axes, "--synchronize", "space"], 2, folder, "axes")
    check_answer(["profile", axes, "--to", "1m"], 2, folder, "axes")
    check_answer(["profile", "no_axes.toml"], 2, folder, "axes")


def check_path(folder):
    out = examples / "paths/out.path"
    check_answer(["path", out], 0, folder)
    check_answer(["path", examples / "drive_swerve.toml", out, "--velocity", "2m/s"], 0, folder)
    check_answer(["path", examples / "paths/two_pieces.auto", "--mirror"], 0, folder)
    check_answer(["path", examples / "elevator.toml", out], 2, folder)
    check_answer(["path", "nowhere.traj"], 2, folder)


def check_states(folder):
    machine = (examples / "states.toml").read_text()
    (folder / "safe.toml").write_text(machine)
    check_answer(["states", "safe.toml"], 0, folder)
    (folder / "unsafe.toml").write_text(machine.replace('to = "floor"\norder = ["height", "arm"]', 'to = "floor"'))
    check_answer(["states", "unsafe.toml"], 1, folder)
    (folder / "wrong.toml").write_text(machine.replace("height", "width", 1))
    check_answer(["states", "wrong.toml"], 2, folder)


def check_localize(folder):
    (folder / "odometry.csv").write_text(
        "time,v,w\n" + "\n".join(f"{0.1 * k:.2f},0.2,0.1" for k in range(100)))
    (folder / "landmarks.csv").write_text("1,4,1\n2,4,-1\n3,3,3\n")
    rows = []
    for k in range(50):
        t = 0.2 * k
        heading, x, y = 0.1 * t, 2 * math.sin(0.1 * t), 2 * (1 - math.cos(0.1 * t))
        for mark, mx, my in ((1, 4, 1), (2, 4, -1), (3, 3, 3)):
            bearing = math.atan2(my - y, mx - x) - heading
            rows.append(f"{t},{mark},{math.hypot(mx - x, my - y)},{bearing}")
    (folder / "sightings.csv").write_text("\n".join(rows))
    files = ["localize", "odometry.csv", "landmarks.csv", "sightings.csv"]
    check_answer(files, 0, folder)
    check_answer(files[:3], 2, folder)


def check_places(folder):
    """Every error of a file has its line and column."""
    (folder / "place.toml").write_text('[mechanism]\ntype = "elevator"\nmass = 8\n  gearng = 2\n')
    errors = answer(["design", "place.toml"], 2, folder)["errors"]
    places = {(error["code"], error["line"], error["column"]) for error in errors}
    if not {("wrong_unit", 3, 8), ("unknown_key", 4, 3)} <= places:
        failures.append(f"places: {errors}")


def check_reader_and_schema(folder):
    """What the reader says of a value, the schema says too: each key with values of every type."""
    schema = json.loads((schemas / "project.schema.json").read_text())
    values = {"1": 1, "1.5": 1.5, '"10"': "10", '"x"': "x", '""': "", "true": True, "[]": [], "[1]": [1]}
    base = '[mechanism]\ntype = "elevator"\n'
    for section, told in schema["properties"].items():
        if section in ("model", "point", "simulation", "fit", "estimate", "swing_up"):
            continue
        for key in told["properties"]:
            if key in ("type", "motor", "tolerance", "limit", "reference", "mechanism", "follower"):
                continue
            drives = section in ("drive", "disturbance", "optimize")
            for text, value in values.items():
                head = '[drive]\ntype = "swerve"\n' if drives else base
                if section not in ("mechanism", "drive"):
                    head += f"[{section}]\n"
                (folder / "one.toml").write_text(f"{head}{key} = {text}\n")
                done = subprocess.run([command, "analyze", "one.toml", "--json"], cwd=folder,
                                      capture_output=True, text=True)
                document = json.loads(done.stdout)
                errors = document.get("errors", [document["error"]] if "error" in document else [])
                name = f"{section}.{key} "
                # What a key means beside others, and the largest share of something, only the reader knows.
                refused = any(f": {name}is " in e["message"] and "is missing" not in e["message"]
                              and "is without" not in e["message"] for e in errors)
                if (section, key, value) in (("drive", "zeta", 1.5), ("size", "efficiency", 1.5)):
                    refused = False
                project = {"drive": {"type": "swerve"}} if drives else {"mechanism": {"type": "elevator"}}
                project.setdefault(section, {})[key] = value
                wrong = not validator("project").is_valid(project)
                # A text with a number is the schema's limit: units are the reader's.
                if refused != wrong and not (refused and isinstance(value, str) and not wrong):
                    failures.append(f"{name}= {text}: reader {refused}, schema {wrong}: {errors}")


def check_refusals(folder):
    wrong = folder / "wrong.toml"
    wrong.write_text('[mechanism]\ntype = "elevator"\nmass = 8\ngearng = 2\n')
    for name in ("design", "analyze"):
        document = check_answer([name, wrong], 2, folder)
        codes = sorted(error["code"] for error in document.get("errors", []))
        if codes != ["missing_key", "missing_key", "unknown_key", "wrong_unit"]:
            failures.append(f"{name}: not every error is told: {document}")
    check_says_no("project", tomllib.loads(wrong.read_text()), "wrong.toml")
    still = json.loads((examples / "logs/elevator.json").read_text())
    for test in ("slow-forward", "slow-backward", "fast-forward", "fast-backward"):
        for row in still[test]:
            row[2:4] = [0.25, 0.0]
    (folder / "still.json").write_text(json.dumps(still))
    for name in ("identify", "tune"):
        check_answer([name, "still.json"], 1, folder)
        check_answer([name, "nowhere.json"], 2, folder)
    heavy = folder / "heavy.toml"
    heavy.write_text((examples / "elevator.toml").read_text().replace("8 kg", "80000 kg"))
    check_answer(["design", heavy], 1, folder)


def check_project_schema():
    good = tomllib.loads((examples / "elevator.toml").read_text())
    check("project", good, "elevator.toml")
    for section, key, value in [
        ("mechanism", "type", "escalator"), ("mechanism", "gearing", 0), ("mechanism", "mass", 8),
        ("mechanism", "mass", "-8 kg"), ("mechanism", "motor", {"stall_torque": "1 N m"}),
        ("mechanism", "motor_count", 0), ("controller", "period", 0.02), ("controller", "perod", "1 s"),
        ("controller", "state_tolerance", [1, 2]), ("profile", "seed", 1.5), ("controler", "period", "1 s"),
    ]:
        wrong = copy.deepcopy(good)
        wrong.setdefault(section, {})[key] = value
        check_says_no("project", wrong, f"{section}.{key} = {value}")


with tempfile.TemporaryDirectory() as name:
    check_answers(pathlib.Path(name))
    check_drivetrain(pathlib.Path(name))
    check_refusals(pathlib.Path(name))
    check_each(pathlib.Path(name))
    check_localize(pathlib.Path(name))
    check_estimate(pathlib.Path(name))
    check_motors(pathlib.Path(name))
    check_units(pathlib.Path(name))
    check_profile(pathlib.Path(name))
    check_path(pathlib.Path(name))
    check_states(pathlib.Path(name))
    check_plan(pathlib.Path(name))
    check_places(pathlib.Path(name))
    check_reader_and_schema(pathlib.Path(name))
check_project_schema()
for failure in failures[:20]:
    print(failure, file=sys.stderr)
sys.exit(1 if failures else 0)
