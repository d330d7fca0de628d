"""Reads a record with the tools that others use, and checks that they agree.

    python read_record.py FILE.mcap

Opens it with `mcap` + `mcap-ros2-support` and with `rosbags`, compares what each of them decodes, and
prints one JSON object: messages per topic, and the last torque, contact force and transfer. Exit code 0
only where everything could be decoded and both agree.
"""

import json
import math
import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

EXPECTED = {
    "/control/state": "rack_msgs/msg/ControlState",
    "/desired": "geometry_msgs/msg/PoseStamped",
    "/events": "diagnostic_msgs/msg/DiagnosticArray",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/plant/contact": "geometry_msgs/msg/WrenchStamped",
    "/plant/joint_states": "sensor_msgs/msg/JointState",
    "/plant/state": "rack_msgs/msg/PlantState",
    "/plant/tool": "geometry_msgs/msg/PoseStamped",
    "/robot_description": "std_msgs/msg/String",
    "/target": "geometry_msgs/msg/PoseStamped",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tool": "geometry_msgs/msg/PoseStamped",
    "/vme/latency": "rack_msgs/msg/Latency",
    "/vme/masters": "rack_msgs/msg/MasterUse",
    "/vme/transfers": "rack_msgs/msg/Transfers",
    "/wrench": "geometry_msgs/msg/WrenchStamped",
}


def summary(topic, message):
    """What is compared between the readers; every kind of field once."""
    if topic in ("/joint_states", "/plant/joint_states"):
        return list(message.name), list(message.position), list(message.velocity), list(message.effort)
    if topic in ("/wrench", "/plant/contact"):
        force, torque = message.wrench.force, message.wrench.torque
        return [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    if topic in ("/tool", "/target", "/desired", "/plant/tool"):
        position, q = message.pose.position, message.pose.orientation
        return [position.x, position.y, position.z, q.x, q.y, q.z, q.w]
    if topic in ("/tf", "/tf_static"):
        return [
            (t.header.frame_id, t.child_frame_id, t.transform.translation.z, t.transform.rotation.w)
            for t in message.transforms
        ]
    if topic == "/events":
        return [(s.name, s.message, [(v.key, v.value) for v in s.values]) for s in message.status]
    if topic == "/robot_description":
        return message.data
    if topic == "/vme/transfers":
        return [
            message.window_from,
            message.window_until,
            [(t.requested, t.data_at, t.done, t.address, t.job, t.index, t.slave, t.status) for t in message.transfers],
        ]
    if topic == "/vme/latency":
        return [message.job, message.whole, message.filter, message.execution, message.write]
    if topic == "/vme/masters":
        return [message.master, message.transfers, message.held, message.utilisation, list(message.wait)]
    if topic == "/control/state":
        return [message.job, message.force_age_ns, list(message.torque), message.xt.position.z, message.fd.force.z]
    if topic == "/plant/state":
        return [list(message.spring_torque), message.contact.force.z, message.penetration, message.energy, message.status]
    raise SystemExit(f"unexpected topic {topic}")


def plain(value):
    """Numbers of any library as Python's own, so that they compare."""
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, str):
        return value
    value = value.item() if hasattr(value, "item") else value
    return "nan" if isinstance(value, float) and math.isnan(value) else value


def with_mcap(path):
    messages = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        assert attachments["scenario.toml"], "the resolved scenario is not attached"
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        assert int(metadata["vmerack"]["seed"]) >= 0
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert schema.encoding == "ros2msg" and channel.message_encoding == "cdr"
            if channel.topic.startswith("/wall/"):
                continue
            assert EXPECTED[channel.topic] == schema.name, channel.topic
            key = (channel.topic, message.log_time)
            messages.setdefault(key, []).append(plain(summary(channel.topic, decoded)))
    return messages


def with_rosbags(path):
    messages = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, timestamp, data in reader.messages():
            if connection.topic.startswith("/wall/"):
                continue
            decoded = reader.deserialize(data, connection.msgtype)
            messages.setdefault((connection.topic, timestamp), []).append(plain(summary(connection.topic, decoded)))
    return messages


def main():
    path = Path(sys.argv[1])
    first, second = with_mcap(path), with_rosbags(path)
    assert first.keys() == second.keys(), "the readers see different messages"
    different = [key for key in first if first[key] != second[key]]
    assert not different, f"the readers decode differently: {different[:3]}"
    counts = Counter()
    last = {}
    for (topic, _), values in first.items():
        counts[topic] += len(values)
        last[topic] = values[-1]
    print(
        json.dumps(
            {
                "messages": dict(sorted(counts.items())),
                "last_torque": last["/joint_states"][3],
                "last_contact": last["/plant/contact"],
                "last_transfers": last["/vme/transfers"],
            }
        )
    )


if __name__ == "__main__":
    main()
