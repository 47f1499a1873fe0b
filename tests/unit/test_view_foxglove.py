"""What Foxglove shows of a recording by itself: messages of its own schemas, where the drawings are."""

import json
import math

import pytest
from deixis_cli.mcap_file import McapReader, McapRecorder, keys_in
from deixis_cli.raw_message import RawMessage
from deixis_cli.shown import show_by_all
from deixis_schemas import codec, topics
from deixis_schemas.samples import SAMPLES
from deixis_view.drawing import Arrows, Boxes, Dots, Drawing, Lines, Note, Page, Picture, Shot, Value
from deixis_view.floor import shown
from deixis_view.foxglove import FoxgloveSink
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

RED = (255, 0, 0)
STAMP_NS = 1_500_000_001_250_000_000


def drawn(*drawings):
    sink = FoxgloveSink()
    sink.draw(Shot(STAMP_NS, 3, [Drawing(path, what) for path, what in drawings]))
    return {item.topic: item for item in sink.take()}


def over(*drawings):
    read = ImageAnnotations()
    read.ParseFromString(drawn(*drawings)["shown/annotations"].payload)
    return read


def above(*drawings):
    read = SceneUpdate()
    read.ParseFromString(drawn(*drawings)["shown/map"].payload)
    return {entity.id: entity for entity in read.entities}


def test_a_box_is_a_closed_line_of_its_corners_with_its_label():
    read = over(("picture/tracks", Boxes([(10, 20, 30, 40)], ["face"], [RED])))
    (line,) = read.points
    assert line.type == line.LINE_LOOP
    assert [(p.x, p.y) for p in line.points] == [(10.5, 20.5), (40.5, 20.5), (40.5, 60.5), (10.5, 60.5)]
    assert (line.outline_color.r, line.outline_color.g, line.outline_color.a) == (1, 0, 1)
    (text,) = read.texts
    assert (text.text, text.position.x, text.position.y) == ("face", 10, 20)
    assert line.timestamp.seconds == 1_500_000_001
    assert line.timestamp.nanos == 250_000_000


def test_an_arrow_ends_where_it_points():
    (line,) = over(("picture/yaw", Arrows([(0, 0)], [(40, 0)], [], [RED]))).points
    assert [(p.x - 0.5, p.y - 0.5) for p in line.points] == [(0, 0), (40, 0), (30, -10), (40, 0), (30, 10)]


def test_what_is_not_drawn_anew_stays_over_the_picture_until_it_is():
    sink = FoxgloveSink()
    sink.draw(Shot(1, 1, [Drawing("picture/tracks", Boxes([(0, 0, 1, 1)], ["a"], [RED]))]))
    sink.draw(Shot(2, 2, [Drawing("picture/fingertips", Dots([(5, 5)], [3], [], [RED]))]))
    sink.draw(Shot(3, 3, [Drawing("picture/tracks", Boxes())]))
    counts = []
    for item in sink.take():
        read = ImageAnnotations()
        read.ParseFromString(item.payload)
        counts.append(len(read.points))
    assert counts == [1, 2, 1]


def test_the_place_is_in_metres_of_the_map():
    entities = above(
        ("map/walls", Lines([[shown(1, 2), shown(3, -4)]], [2.0], [], [RED])),
        ("map/pois", Dots([shown(2.5, 1.5)], [0.1], ["vase"], [RED])),
    )
    (wall,), (ball,), (text,) = entities["map/walls"].lines, entities["map/pois"].spheres, entities["map/pois"].texts
    assert [(p.x, p.y) for p in wall.points] == [(1, 2), (3, -4)]
    assert (ball.pose.position.x, ball.pose.position.y, ball.size.x) == (2.5, 1.5, 0.2)
    assert text.text == "vase"
    assert {entity.frame_id for entity in entities.values()} == {"map"}


def test_curves_pages_and_notes_are_messages_of_their_own():
    made = drawn(
        ("belief/0/P3", Value(0.75)), ("reason", Page("**why**")), ("log", Note("P3")), ("picture", Picture(b"\xff\xd8"))
    )
    assert json.loads(made["shown/belief/0/P3"].payload) == {"value": 0.75}
    assert json.loads(made["shown/reason"].payload) == {"markdown": "**why**"}
    assert made["shown/log"].schema == "foxglove.Log"
    assert made["shown/picture"].schema == "foxglove.CompressedImage"


def test_a_page_that_says_the_same_is_not_said_again():
    sink = FoxgloveSink()
    for _ in range(3):
        sink.draw(Shot(1, 1, [Drawing("reason", Page("same"))]))
    assert len(sink.take()) == 1


@pytest.fixture
def sent():
    topic_of = {topic.type: topic for topic in topics.TOPICS}
    return [
        RawMessage(
            topic_of[type(message)].key("r1", stage="tracker", id="door"),
            codec.encoding_of(type(message)),
            codec.encode(message),
            1_000 + place,
        )
        for place, message in enumerate(SAMPLES)
    ]


def test_a_recording_holds_both_and_gives_back_what_was_sent(tmp_path, sent):
    broken = RawMessage("deixis/r1/tracker/tracks", "zenoh/bytes", b"\x00garbage", 5_002)
    path = tmp_path / "a.mcap"
    with McapRecorder(path, show_by_all(None)) as recorder:
        for message in [*sent, broken]:
            recorder.write(message)
    assert list(McapReader(path)) == [*sent, broken]
    assert keys_in(path) == {message.key for message in sent}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        drawn_there = reader.iter_decoded_messages(topics=["shown/map", "shown/annotations"])
        found = {channel.topic: read for _, channel, _, read in drawn_there}
    assert found["shown/map"].DESCRIPTOR.full_name == "foxglove.SceneUpdate"
    assert found["shown/annotations"].DESCRIPTOR.full_name == "foxglove.ImageAnnotations"


def test_points_of_the_view_from_above_come_back_to_the_map():
    for x, y in ((1.0, 2.0), (-3.5, 0.25)):
        assert math.dist(shown(*shown(x, y)), (x, y)) == 0
