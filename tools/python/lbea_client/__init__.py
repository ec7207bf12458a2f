"""Frames and results of lbea over ZeroMQ, in plain Python.

    for result in lbea_client.Results("ipc:///tmp/lbea-results"):
        print(result.frame_id, result.status, result.matches[0].simulation_name)

Needs numpy, pyzmq and flatbuffers (Debian: python3-numpy, python3-zmq, python3-flatbuffers).
"""
from .messages import DamagedMessage, Frame, Inference, decode_frame, decode_inference, decode_result, encode_end_of_stream, encode_frame
from .sockets import FrameReceiver, FrameSender, Inferences, Results

__all__ = ["DamagedMessage", "Frame", "FrameReceiver", "FrameSender", "Inference", "Inferences", "Results", "decode_frame",
           "decode_inference", "decode_result",
           "encode_end_of_stream", "encode_frame"]
