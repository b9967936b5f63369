"""ROS 2 topics without a ROS installation, by Cyclone DDS. Needs the extra ``[live]``."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.serde import SerdeError

from mapquilt.live.ros2.dds_types import STORE, cdr_type

_COMPATIBLE = (
    "<CycloneDDS><Domain><Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
    "</Domain></CycloneDDS>"
)
"""Without it nothing is received from ROS 2 Kilted, whose type information differs."""

_LOCALHOST = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>'
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""Finds participants of this machine alone, as the variables of ROS may ask."""

_MOST_TAKEN = 100
"""Messages that a reader keeps and gives at once; latched publishers and readers of maps keep one."""


@dataclass(frozen=True)
class Quality:
    """Quality of service of a publisher: ``reliable`` or best effort, ``latched`` (transient local) or volatile."""

    reliable: bool
    latched: bool

    def both(self, other: Quality) -> Quality:
        """Return the quality that a reader may ask for to hear both publishers."""
        return Quality(self.reliable and other.reliable, self.latched and other.latched)

    def __str__(self) -> str:
        return f"{'reliable' if self.reliable else 'best effort'}, {'latched' if self.latched else 'volatile'}"


LATCHED, STREAM = Quality(True, True), Quality(True, False)


@dataclass(frozen=True)
class Publisher:
    """A publisher on the network: its ROS ``topic``, the DDS name of its ``kind``, its quality, and if it is ours."""

    topic: str
    kind: str
    quality: Quality
    ours: bool


class Network:
    """A participant of a DDS domain, which names topics and types as ROS 2 does.

    ``CYCLONEDDS_URI`` is honoured; else ``ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`` and ``ROS_LOCALHOST_ONLY=1`` are.
    Raises ``ValueError`` if the domain cannot be joined.
    """

    def __init__(self, domain: int = 0) -> None:
        with _naming(f"domain {domain}"):
            self._domain = Domain(domain, configuration(os.environ))
            self._participant = DomainParticipant(domain)
            self._discovery = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        self._writers: dict[str, DataWriter[Any]] = {}
        self._publishers: dict[Any, Publisher] = {}

    def publish(self, topic: str, message: Any, quality: Quality = STREAM) -> None:
        """Send a message of rosbags' types; a topic keeps the quality of its first message."""
        kind = message.__msgtype__
        with _naming(topic):
            sample = cdr_type(kind)()
            sample.cdr = bytes(STORE.serialize_cdr(message, kind))
            self.writer(topic, kind, quality).write(sample)

    def writer(self, topic: str, kind: str, quality: Quality) -> DataWriter[Any]:
        """Return the writer of a topic, which is opened at the first call."""
        if topic not in self._writers:
            depth = 1 if quality.latched else _MOST_TAKEN
            self._writers[topic] = DataWriter(self._participant, self._topic(topic, kind), _qos(quality, depth))
        return self._writers[topic]

    def withdraw(self, topic: str) -> None:
        """Close the writer of a topic; a latched message goes with it."""
        self._writers.pop(topic, None)

    def subscribe(self, topic: str, kind: str, quality: Quality, depth: int | None = None) -> Subscription:
        """Open a reader that keeps the last ``depth`` messages; None stands for many."""
        with _naming(topic):
            qos = _qos(quality, depth or _MOST_TAKEN)
            return Subscription(DataReader(self._participant, self._topic(topic, kind), qos), kind)

    def publishers(self) -> Mapping[Any, Publisher]:
        """Return the publishers of ROS topics that are on the network now."""
        ours = self._participant.guid
        for sample in self._discovery.take(_MOST_TAKEN):
            if sample.topic_name is None:  # it has gone
                self._publishers.pop(sample.key, None)
            elif sample.topic_name.startswith("rt/"):
                self._publishers[sample.key] = Publisher(
                    sample.topic_name.removeprefix("rt"),
                    sample.type_name,
                    _quality(sample.qos),
                    sample.participant_key == ours,
                )
        return dict(self._publishers)

    def _topic(self, topic: str, kind: str) -> Topic[Any]:
        return Topic(self._participant, f"rt{topic}", cdr_type(kind))


class Subscription:
    """A reader of one topic."""

    def __init__(self, reader: DataReader[Any], kind: str) -> None:
        self._reader, self._kind = reader, kind

    def take(self) -> Iterator[Any]:
        """Yield the messages that came since, as rosbags decodes them; None for one that cannot be decoded."""
        for sample in self._reader.take(_MOST_TAKEN):
            if hasattr(sample, "cdr"):
                yield decoded(sample.cdr, self._kind)


def decoded(data: bytes, kind: str) -> Any:
    """Return the message of a type that these bytes hold; None if they hold none."""
    try:
        return STORE.deserialize_cdr(data, kind)
    except (SerdeError, ValueError):
        return None


def configuration(environment: Mapping[str, str]) -> str:
    """Return the configuration of Cyclone DDS. Where it finds others, ``CYCLONEDDS_URI`` says alone, if it is set."""
    if environment.get("CYCLONEDDS_URI"):
        return f"{_COMPATIBLE},{environment['CYCLONEDDS_URI']}"
    on_this_machine = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    if on_this_machine or environment.get("ROS_LOCALHOST_ONLY") == "1":
        return f"{_COMPATIBLE},{_LOCALHOST}"
    return _COMPATIBLE


def _qos(quality: Quality, depth: int) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)) if quality.reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if quality.latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


def _quality(qos: Qos) -> Quality:
    reliable = isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)
    durable = qos[Policy.Durability]
    return Quality(reliable, durable is not None and durable != Policy.Durability.Volatile)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    """Raise ``ValueError`` that names the topic or domain for an error of DDS in this block."""
    try:
        yield
    except DDSException as error:
        raise ValueError(f"{what}: {error.msg}; is the network interface of CYCLONEDDS_URI there?") from None
