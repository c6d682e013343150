"""Reads an MCAP file by the official reader and compares it with the run that it is of.

    21-mcap.py FILE.mcap
        of the four frames that 21-mcap.sh writes
    21-mcap.py FILE.mcap FOLDER-OF-THE-RUN MODEL.json FILE.dbc
        with trace.log, with truth.csv, and with what cantools decodes, brought to the joints by the model's numbers
"""

import csv
import importlib
import json
import math
import sys
from collections import defaultdict
from pathlib import Path

import cantools
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.json_format import MessageToDict
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

ROUNDING = 1e-6  # of numbers of six digits, which the controller has
AXES = ["shoulder", "elbow", "lift", "wrist"]

topics = defaultdict(list)
schemas = {}
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
    for schema, channel, message, value in reader.iter_decoded_messages(log_time_order=False):
        assert message.sequence == len(topics[channel.topic]), (channel.topic, message.sequence)
        assert message.log_time == message.publish_time
        topics[channel.topic].append((message.log_time, value, message.data))
        schemas[channel.topic] = schema
    summary = reader.get_summary()
counts = {summary.channels[number].topic: count for number, count in summary.statistics.channel_message_counts.items()}
assert counts == {topic: len(messages) for topic, messages in topics.items()}, counts


def nanos(stamp):
    return stamp.seconds * 10**9 + stamp.nanos


def frames(topic):
    """Frames as candump writes them."""
    for time, frame, _ in topics[topic]:
        assert nanos(frame.timestamp) == time
        identifier = f"{frame.id | frame.error << 29:0{8 if frame.extended or frame.error else 3}X}"
        data = frame.data.hex().upper()
        if frame.remote:
            text = f"{identifier}#R{frame.length}"
        else:
            assert len(frame.data) == frame.length, frame
            text = f"{identifier}##{frame.brs + 2 * frame.esi:X}{data}" if frame.fd else f"{identifier}#{data}"
        yield f"({time // 10**9:010d}.{time % 10**9 // 1000:06d}) {topic.split('/')[1]} {text}"


if len(sys.argv) == 2:
    assert list(frames("/can0/frames")) == [
        "(1436509052.249713) can0 123#DEADBEEF",
        "(1436509052.250100) can0 123#R4",
    ], list(frames("/can0/frames"))
    assert list(frames("/can1/frames")) == [
        "(1436509052.250000) can1 18FF1234##3DEADBEEF",
        "(1436509052.250200) can1 20000080#0000000000000000",
    ], list(frames("/can1/frames"))
    assert set(topics) == {"/can0/frames", "/can1/frames"}, "an arm, where no frame speaks of one"
    print("  four frames of two interfaces")
    sys.exit()

run, model, dbc = Path(sys.argv[2]), json.loads(Path(sys.argv[3]).read_text()), cantools.database.load_file(sys.argv[4])
assert list(frames("/can0/frames")) == (run / "trace.log").read_text().splitlines(), "frames differ from the trace"
names = {message.frame_id: message.name for message in dbc.messages}
assert all(frame.message == names[frame.id] for _, frame, _ in topics["/can0/frames"])

# What has a name of Foxglove's is described as by Foxglove, and Foxglove's own code reads the same in it.
known = 0
for topic, messages in topics.items():
    package, _, name = schemas[topic].name.partition(".")
    if package != "foxglove":
        continue
    theirs = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)
    ours = {fd.package + "." + kind.name: kind for fd in FileDescriptorSet.FromString(schemas[topic].data).file for kind in fd.message_type}
    pending, seen = [theirs.DESCRIPTOR], set()
    while pending:
        kind = pending.pop()
        if kind.full_name in seen or kind.file.package != "foxglove":
            continue
        seen.add(kind.full_name)
        assert {(field.name, field.number, field.type) for field in kind.fields} == {
            (field.name, field.number, field.type) for field in ours[kind.full_name].field
        }, kind.full_name
        pending += [field.message_type for field in kind.fields if field.message_type]
    for time, value, data in messages:
        assert MessageToDict(theirs.FromString(data)) == MessageToDict(value)
        stamps = value.transforms if name == "FrameTransforms" else value.entities if name == "SceneUpdate" else [value]
        assert stamps and all(nanos(stamp.timestamp) == time for stamp in stamps)
        known += 1

truth = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(open(run / "truth.csv"))]


def joints(topic, member):
    for _, value, _ in topics[topic]:
        assert [joint.name for joint in value.joints] == AXES
    return [[getattr(joint, member) for joint in value.joints] for _, value, _ in topics[topic]]


def columns(name):
    return [[row[f"{name}{axis}"] for axis in (1, 2, 3, 4)] for row in truth]


def alike(what, found, expected, within):
    assert len(found) == len(expected) > 100, (what, len(found), len(expected))
    for number, (one, other) in enumerate(zip(found, expected)):
        for a, b in zip(one, other):
            assert abs(a - b) <= within * max(1, abs(b)), (what, number, one, other)


if "/actual/joint_states" in topics:
    times = [round(row["t"] * 1e6) * 1000 for row in truth]
    for topic in ("/actual/joint_states", "/reference/joint_states"):
        assert [time for time, _, _ in topics[topic]] == times
    for member, name in (("position", "q"), ("velocity", "qd"), ("effort", "tau")):
        alike(member, joints("/actual/joint_states", member), columns(name), 0)
    alike("reference", joints("/reference/joint_states", "position"), columns("rq"), 0)
    alike("reference", joints("/reference/joint_states", "velocity"), columns("rqd"), 0)

# From the motors to the joints. Motor 3 turns with the wrist, too, or the shaft would screw itself up and down.
drive = model["drive"]
ratio = [*drive["gear_ratio"]]
ratio[2] *= 2 * math.pi / drive["ball_screw_lead_m_per_rev"]
coupling = drive["gear_ratio"][2] * drive["screw_hand_sign"]
count = 2 * math.pi / drive["encoder_counts_per_motor_rev"]


def moved(motors):
    wrist = motors[3] / ratio[3]
    return [motors[0] / ratio[0], motors[1] / ratio[1], (motors[2] - coupling * wrist) / ratio[2], wrist]


def pushed(motors):
    own = [motor * by for motor, by in zip(motors, ratio)]
    own[3] += coupling * motors[2]
    return own


feedback = [dbc.decode_message(frame.id, frame.data) for _, frame, _ in topics["/can0/frames"] if frame.message == "Feedback"]
fields = {quantity: [[sample[f"{quantity}_{axis}"] for axis in AXES] for sample in feedback] for quantity in ("position", "velocity", "torque")}
positions = joints("/can0/joint_states", "position")
alike("position", positions, [moved([count * motor for motor in motors]) for motors in fields["position"]], ROUNDING)
alike("velocity", joints("/can0/joint_states", "velocity"), [moved(motors) for motors in fields["velocity"]], ROUNDING)
shares = [[share / 1000 * rated for share, rated in zip(motors, drive["motor_rated_torque"])] for motors in fields["torque"]]
alike("effort", joints("/can0/joint_states", "effort"), [pushed(motors) for motors in shares], ROUNDING)
# Encoders round to a count: the joints are where they truly are.
alike("truth", positions[: len(truth)], columns("q"), 2 * ROUNDING)


def times(a, b):
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def turned(by, vector):
    return times(times(by, (0, *vector)), (by[0], -by[1], -by[2], -by[3]))[1:]


def chained(transforms):
    """Where the last frame of a chain is, and where its x points to."""
    place, rotation, parent = (0, 0, 0), (1, 0, 0, 0), "base"
    for step in transforms:
        assert step.parent_frame_id == parent
        t, r = step.translation, step.rotation
        place = tuple(a + b for a, b in zip(place, turned(rotation, (t.x, t.y, t.z))))
        rotation, parent = times(rotation, (r.w, r.x, r.y, r.z)), step.child_frame_id
    assert parent == "flange"
    return [*place, *turned(rotation, (1, 0, 0))]


found = [chained(value.transforms) for _, value, _ in topics["/tf"]]
flange = [[row["x"], row["y"], row["z"], math.cos(row["yaw"]), math.sin(row["yaw"]), 0] for row in truth]
alike("flange", found[: len(truth)], flange, 5 * ROUNDING)

# The arms reach from joint to joint, and the shaft ends at the flange.
[(_, scene, _)] = topics["/scene"]
steps = {step.child_frame_id: step for step in topics["/tf"][0][1].transforms}
bodies = {entity.frame_id: entity for entity in scene.entities}
assert set(bodies) == {"base", *steps}, set(bodies)
assert all(entity.frame_locked and nanos(entity.lifetime) == 0 for entity in bodies.values())
for frame, following in (("shoulder", "elbow"), ("elbow", "shaft")):
    [cube] = bodies[frame].cubes
    assert abs(cube.size.x - steps[following].translation.x) < 1e-12 and abs(cube.pose.position.x - cube.size.x / 2) < 1e-12
[shaft] = bodies["shaft"].cylinders
assert abs(shaft.pose.position.z - shaft.size.z / 2 - steps["flange"].translation.z) < 1e-12
print(f"  {sum(counts.values())} messages in {len(counts)} channels, {known} of them as Foxglove has them")
