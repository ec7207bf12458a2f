"""Encodes and decodes messages. adapters/wire/schema defines their content."""
import re
from dataclasses import dataclass
from types import SimpleNamespace

import flatbuffers
import numpy

from ._schema import Control, ControlKind
from ._schema import FieldLocation
from ._schema import Frame as frame_schema
from ._schema import Inference as inference_schema
from ._schema import NumericType, PackedElementField, PointCloud, RecordingPhase, Result, SenderCondition, State, Verdict, WireStatus
from ._schema import Time as time_schema

most_result_bytes = 1 << 22  # of a result or state; larger ones are refused
most_inference_bytes = 1 << 26


class DamagedMessage(ValueError):
    """The message is damaged, or of a kind that its socket does not carry."""


@dataclass
class Frame:
    """One captured cloud. points: n x 3 float32, sensor coordinates, read-only; stamp_ns: clock of the sender."""

    session: int
    id: int
    stamp_ns: int
    points: numpy.ndarray
    frame_id: str = "sensor"
    end_of_stream: bool = False


@dataclass
class Inference:
    """A baked field on the whole component, inferred from one frame. values, spread: one per element or node of the model."""

    sequence: int
    session: int
    frame_id: int
    stamp_ns: int
    field: str
    unit: str
    location: str  # "element" or "node"
    values: numpy.ndarray
    spread: numpy.ndarray  # standard deviation over the plausible samples
    model_checksum: int
    bound_90: numpy.ndarray  # 90 % of the true values differ from `values` by less; empty: not known
    component: str = ""  # of several; else empty


def names_of(enumeration):
    return {value: name for name, value in vars(enumeration).items() if not name.startswith("_")}


ENUMERATIONS = {"status": names_of(WireStatus.WireStatus), "verdict": names_of(Verdict.Verdict),
                "condition": names_of(SenderCondition.SenderCondition), "phase": names_of(RecordingPhase.RecordingPhase)}


def snake_case(name):
    """The name in the schema: flatc writes poseTurn for pose_turn, and error90 for error_90."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[a-z])(?=\d\d)", "_", name).lower()


def plain(value):
    """Converts objects of flatc: snake_case attributes, str for text, names for enumerations."""
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if not hasattr(value, "__dict__"):
        return value
    found = SimpleNamespace()
    for name, item in vars(value).items():
        name = snake_case(name)
        names = ENUMERATIONS.get(name)
        setattr(found, name, names.get(item, f"unknown_{name}") if names else plain(item))
    return found


def identifier(message):
    return bytes(message[4:8])


def decode_result(message):
    """Decodes a result or a state to an object with the fields of its schema; `kind` is "result" or "state".

    A table that was not sent is None, a list that was not sent is empty. Raises DamagedMessage.
    """
    kinds = {b"LBRE": ("result", Result.Result, Result.ResultT), b"LBST": ("state", State.State, State.StateT)}
    try:
        if len(message) > most_result_bytes:
            raise ValueError("too large")
        kind, table, unpacked = kinds[identifier(message)]
        found = plain(unpacked.InitFromObj(table.GetRootAs(message)))
    except Exception as error:  # the generated code raises various exceptions for a damaged message
        raise DamagedMessage(f"not a result or state: {error!r}") from error
    found.kind = kind
    if kind == "result":
        found.matches = found.matches or []
        found.channels = found.channels or []
    return found


def decode_inference(message):
    """Decodes an Inference; values, spread and bound_90 are float32 arrays. Raises DamagedMessage."""
    try:
        if identifier(message) != b"LBIN":
            raise ValueError(f"identifier {identifier(message)!r}")
        found = inference_schema.Inference.GetRootAs(message)
        values, spread, bound_90 = (numpy.empty(0, numpy.float32) if getattr(found, f"{name}IsNone")() else getattr(found, f"{name}AsNumpy")()
                                    for name in ("Values", "Spread", "Bound90"))
        if len(values) != len(spread) or len(bound_90) not in (0, len(values)):
            raise ValueError("values, spread and bound_90 have different lengths")
        location = names_of(FieldLocation.FieldLocation)[found.Location()]
        return Inference(found.Sequence(), found.Session(), found.FrameId(), found.StampNs(), (found.Field() or b"").decode(),
                         (found.Unit() or b"").decode(), location, values, spread, found.ModelChecksum(), bound_90, (found.Component() or b"").decode())
    except Exception as error:
        raise DamagedMessage(f"not an inference: {error!r}") from error


def decode_frame(message):
    """Decodes a Frame. Where the layout allows it, its points are a view of the message. Raises DamagedMessage."""
    try:
        if identifier(message) != b"LBFR":
            raise ValueError(f"identifier {identifier(message)!r}")
        frame = frame_schema.Frame.GetRootAs(message)
        if frame.EndOfStream():
            return Frame(frame.Session(), frame.Id(), 0, numpy.empty((0, 3), numpy.float32), "", True)
        cloud = PointCloud.PointCloud.GetRootAs(frame.CloudAsNumpy().tobytes())
        return Frame(frame.Session(), frame.Id(), stamp_of(cloud), points_of(cloud), (cloud.FrameId() or b"").decode())
    except Exception as error:
        raise DamagedMessage(f"not a frame: {error!r}") from error


def stamp_of(cloud):
    return cloud.Timestamp().Sec() * 1_000_000_000 + cloud.Timestamp().Nsec()


def points_of(cloud):
    """x, y and z at any offset within the stride; other fields are ignored."""
    stride, data = cloud.PointStride(), cloud.DataAsNumpy()
    if cloud.DataIsNone():
        return numpy.empty((0, 3), numpy.float32)
    offsets = {}
    for i in range(min(cloud.FieldsLength(), 64)):
        field = cloud.Fields(i)
        if field.Type() == NumericType.NumericType.FLOAT32:
            offsets[field.Name()] = field.Offset()
    places = [offsets[axis] for axis in (b"x", b"y", b"z")]
    if len(data) % stride or max(places) + 4 > stride:
        raise ValueError("fields reach beyond the stride, or the data ends within a point")
    rows = numpy.ndarray((len(data) // stride,), numpy.dtype({"names": list("xyz"), "formats": ["<f4"] * 3, "offsets": places,
                                                              "itemsize": stride}), data)
    if places == [0, 4, 8] and stride == 12:
        return rows.view("<f4").reshape(-1, 3)
    return numpy.stack([rows[axis] for axis in "xyz"], axis=1)


def encode_frame(points, stamp_ns, id, session, frame_id="sensor"):
    """points: n x 3 numbers. stamp_ns: capture time since 1970."""
    points = numpy.ascontiguousarray(points, "<f4")
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points have shape {points.shape}; give n x 3")
    cloud = encode_cloud(points, stamp_ns, frame_id)
    builder = flatbuffers.Builder(len(cloud) + 256)
    nested = builder.CreateNumpyVector(numpy.frombuffer(cloud, numpy.uint8))
    frame_schema.FrameStart(builder)
    frame_schema.FrameAddSession(builder, session)
    frame_schema.FrameAddId(builder, id)
    frame_schema.FrameAddCloud(builder, nested)
    builder.Finish(frame_schema.FrameEnd(builder), b"LBFR")
    return bytes(builder.Output())


def encode_cloud(points, stamp_ns, frame_id):
    seconds, nanoseconds = divmod(int(stamp_ns), 1_000_000_000)
    if not 0 <= seconds < 1 << 32:
        raise ValueError(f"stamp_ns {stamp_ns} is not between 1970 and 2106")
    builder = flatbuffers.Builder(points.nbytes + 512)
    data = builder.CreateNumpyVector(points.reshape(-1).view(numpy.uint8))
    name = builder.CreateString(frame_id)
    fields = [encode_field(builder, axis, 4 * i) for i, axis in enumerate("xyz")]
    PointCloud.PointCloudStartFieldsVector(builder, 3)
    for field in reversed(fields):
        builder.PrependUOffsetTRelative(field)
    fields = builder.EndVector()
    PointCloud.PointCloudStart(builder)
    PointCloud.PointCloudAddFrameId(builder, name)
    PointCloud.PointCloudAddPointStride(builder, 12)
    PointCloud.PointCloudAddFields(builder, fields)
    PointCloud.PointCloudAddData(builder, data)
    PointCloud.PointCloudAddTimestamp(builder, time_schema.CreateTime(builder, seconds, nanoseconds))
    builder.Finish(PointCloud.PointCloudEnd(builder))
    return builder.Output()


def encode_field(builder, name, offset):
    name = builder.CreateString(name)
    PackedElementField.PackedElementFieldStart(builder)
    PackedElementField.PackedElementFieldAddName(builder, name)
    PackedElementField.PackedElementFieldAddOffset(builder, offset)
    PackedElementField.PackedElementFieldAddType(builder, NumericType.NumericType.FLOAT32)
    return PackedElementField.PackedElementFieldEnd(builder)


def is_control(message):
    return identifier(message) == b"LBCO"


def encode_control(kind, next_id, withheld, session):
    """Encodes a control message of a sender. kind: "hello", "heartbeat" or "goodbye". withheld: number of the last captures
    before next_id that could not be sent."""
    builder = flatbuffers.Builder(64)
    Control.ControlStart(builder)
    Control.ControlAddSession(builder, session)
    Control.ControlAddKind(builder, getattr(ControlKind.ControlKind, kind))
    Control.ControlAddNextId(builder, next_id)
    Control.ControlAddWithheld(builder, withheld)
    builder.Finish(Control.ControlEnd(builder), b"LBCO")
    return bytes(builder.Output())


def encode_end_of_stream(next_id, session):
    builder = flatbuffers.Builder(64)
    frame_schema.FrameStart(builder)
    frame_schema.FrameAddSession(builder, session)
    frame_schema.FrameAddId(builder, next_id)
    frame_schema.FrameAddEndOfStream(builder, True)
    builder.Finish(frame_schema.FrameEnd(builder), b"LBFR")
    return bytes(builder.Output())
