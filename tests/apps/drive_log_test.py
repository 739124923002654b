#!/usr/bin/env python3
"""Reads the WPILOG of `flyball drive` by the format's specification alone, struct by schema.

Usage: drive_log_test.py FLYBALL PROJECT [option ...]. What AdvantageScope would show (poses, module
states, a Mechanism2d) is held against the same run's CSV. Source: WPILib's datalog.adoc 1.0 and
struct.adoc.
"""
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile


def strings(data, offset, count):
    """So many texts, each behind its length."""
    found = []
    for _ in range(count):
        (length,) = struct.unpack_from("<I", data, offset)
        text = data[offset + 4:offset + 4 + length]
        assert len(text) == length, "a text beyond its record"
        found.append(text.decode("utf-8"))
        offset += 4 + length
    assert offset == len(data), "bytes behind a control record"
    return found


def read_log(data):
    """Entries by their names: (type, metadata, [(time in microseconds, payload)])."""
    assert data[:6] == b"WPILOG" and data[6:8] == b"\x00\x01", "the header"
    (extra,) = struct.unpack_from("<I", data, 8)
    at = 12 + extra
    data[12:at].decode("utf-8")
    entries, names = {}, {}
    while at < len(data):
        bits = data[at]
        assert bits & 0x80 == 0, "bit 7 of a record"
        sizes = (bits & 3) + 1, ((bits >> 2) & 3) + 1, ((bits >> 4) & 7) + 1
        at += 1
        number = []
        for size in sizes:
            number.append(int.from_bytes(data[at:at + size], "little"))
            at += size
        entry, size, time = number
        payload = data[at:at + size]
        assert len(payload) == size, "a record beyond the file"
        at += size
        if entry == 0:
            kind = payload[0]
            (of,) = struct.unpack_from("<I", payload, 1)
            if kind == 0:
                assert of not in names, "an id that is taken"
                name, type_, metadata = strings(payload, 5, 3)
                assert name not in entries, f"{name} twice"
                entries[name] = (type_, metadata, [])
                names[of] = name
            else:
                assert kind in (1, 2), f"control record {kind}"
        else:
            entries[names[entry]][2].append((time, payload))
    return entries


def layout_of(name, entries, seen=()):
    """The struct's members down to doubles, by the schemas in the log: ["translation/x", ...]."""
    assert name not in seen, "a struct within itself"
    type_, _, records = entries["/.schema/struct:" + name]
    assert type_ == "structschema" and len(records) == 1
    members = []
    for part in records[0][1].decode("utf-8").split(";"):
        if not part.strip():
            continue
        of, member = part.split()
        members += ([member] if of == "double" else
                    [f"{member}/{inner}" for inner in layout_of(of, entries, (*seen, name))])
    return members


def structs(name, entries):
    """Per record a list of {member: value}."""
    type_, _, records = entries[name]
    assert type_.startswith("struct:"), type_
    members = layout_of(type_[7:].removesuffix("[]"), entries)
    rows = []
    for time, payload in records:
        values = struct.unpack(f"<{len(payload) // 8}d", payload)
        assert len(values) % len(members) == 0
        several = [dict(zip(members, values[i:i + len(members)])) for i in range(0, len(values), len(members))]
        assert type_.endswith("[]") or len(several) == 1
        rows.append((time, several))
    return rows


def double(name, entries):
    type_, _, records = entries[name]
    assert type_ == "double", (name, type_)
    return [(time, struct.unpack("<d", payload)[0]) for time, payload in records]


def main():
    flyball, project, *options = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "report"
        subprocess.run([flyball, "drive", project, *options, "--out", out], check=True, stdout=subprocess.DEVNULL)
        entries = read_log((out / "data/drive.wpilog").read_bytes())
        with open(out / "data/drive.csv", encoding="utf-8") as file:
            rows = [{key.split(" (")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        kind = json.loads((out / "result.json").read_text())["drivetrain"]

    def near(a, b):
        assert abs(a - b) <= 1e-9 * max(1.0, abs(b)), (a, b)

    for name, columns in (("Pose", ("x", "y", "heading")),
                          ("Reference", ("reference_x", "reference_y", "reference_heading"))):
        poses = structs("/Flyball/Drive/" + name, entries)
        assert len(poses) == len(rows)
        for (time, (pose,)), row in zip(poses, rows):
            near(time / 1e6, row["time"])
            for member, column in zip(("translation/x", "translation/y", "rotation/value"), columns):
                near(pose[member], row[column])
    for name, before in (("Speeds", ""), ("WantedSpeeds", "wanted_")):
        for (_, (speeds,)), row in zip(structs("/Flyball/Drive/" + name, entries), rows):
            for member in ("vx", "vy", "omega"):
                near(speeds[member], row[before + member])
    wheels = ("left", "right") if kind == "differential" else ("front_left", "front_right", "back_left", "back_right")
    if kind == "swerve":
        states = structs("/Flyball/Drive/ModuleStates", entries)
        assert len(states) == len(rows)
        for (_, modules), row in zip(states, rows):
            assert len(modules) == 4
            for module, wheel in zip(modules, wheels):
                near(module["speed"], row[wheel + "_speed"])
                near(module["angle/value"], row[wheel + "_angle"])

    # The Mechanism2d as network tables have it: a canvas, roots with places, lines on them.
    root = "NT:/SmartDashboard/Drive/"
    below = {name: entry for name, entry in entries.items() if name.startswith(root)}
    for name, (_, metadata, records) in below.items():
        assert json.loads(metadata)["source"] == "NT" and records, name
    text = {name: entry[2][0][1].decode("utf-8") for name, entry in below.items() if entry[0] == "string"}
    assert text[root + ".type"] == "Mechanism2d"
    assert len(text[root + "backgroundColor"]) == 7
    width, height = struct.unpack("<2d", below[root + "dims"][2][0][1])
    for wheel in wheels:
        for axis, size in (("x", width), ("y", height)):
            assert 0.0 < double(f"{root}{wheel}/{axis}", entries)[0][1] < size
        line = f"{root}{wheel}/wheel/"
        assert text[line + ".type"] == "line" and text[line + "color"].startswith("#")
        assert double(line + "weight", entries)[0][1] > 0.0
        angles, lengths = double(line + "angle", entries), double(line + "length", entries)
        assert len(angles) == len(lengths) == len(rows)
        scale = max(abs(row[wheel + "_speed"]) for row in rows) / max(abs(length) for _, length in lengths)
        for (time, angle), (_, length), row in zip(angles, lengths, rows):
            near(time / 1e6, row["time"])
            near(angle, 90.0 + math.degrees(row.get(wheel + "_angle", 0.0)))
            near(scale * length, row[wheel + "_speed"])
    print(f"{len(entries)} entries, {len(rows)} rows, {kind}")


if __name__ == "__main__":
    main()
