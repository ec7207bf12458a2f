"""Sockets of the wire. Each is for one thread."""
import fcntl
import os
import secrets
import stat
import threading
import time
import weakref

import zmq

from .keys import client_keys
from .messages import (DamagedMessage, decode_frame, decode_inference, decode_result, encode_control, encode_end_of_stream,
                       encode_frame, is_control, most_inference_bytes, most_result_bytes)

most_frame_bytes = 1 << 28
heartbeat_s = 0.2


def make_socket(kind, high_water_mark, most_bytes, linger_ms=0, keys=None):
    socket = zmq.Context.instance().socket(kind)
    socket.set_hwm(high_water_mark)
    socket.setsockopt(zmq.LINGER, linger_ms)
    socket.setsockopt(zmq.MAXMSGSIZE, most_bytes)
    # A subscription is sent as soon as there is a connection; with IMMEDIATE only in the first poll after it.
    socket.setsockopt(zmq.IMMEDIATE, int(kind != zmq.SUB))
    socket.setsockopt(zmq.HANDSHAKE_IVL, 5000)  # no ZMQ_HEARTBEAT_IVL: see adapters/wire/WIRE.md
    for option, value in (keys or {}).items():
        socket.setsockopt(option, value)
    return socket


class Closing:
    """Closes its socket in close() or at the end of a with block."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.socket.close()


class Subscriber(Closing):
    """Receives what a running lbea-serve publishes: iterate over it, or call receive().

    lost: number of messages lost because this subscriber was too slow. damaged: number of unreadable messages.
    """

    def __init__(self, endpoint, timeout_s=None, server_key=None, key=None, *, decode, held, most_bytes):
        """timeout_s: iteration ends when no message arrives for this time; None: never. server_key, key: key files, for a
        matcher with keys."""
        self.timeout_s, self.lost, self.damaged = timeout_s, 0, 0
        self._next_sequence, self._decode_message = None, decode
        self.socket = make_socket(zmq.SUB, held, most_bytes, keys=client_keys(server_key, key))
        self.socket.setsockopt(zmq.SUBSCRIBE, b"")
        self.socket.connect(endpoint)

    def receive(self, timeout_s=None):
        """Returns the next message; None when none arrives within timeout_s seconds. timeout_s None: no limit."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            wait_ms = None if deadline is None else max(0, round(1000 * (deadline - time.monotonic())))
            if not self.socket.poll(wait_ms):
                return None
            message = self._decode(self.socket.recv())
            if message is not None and self._wanted(message):
                return message

    def _decode(self, raw):
        try:
            message = self._decode_message(raw)
        except DamagedMessage:
            self.damaged += 1
            return None
        if self._next_sequence is not None and message.sequence > self._next_sequence:
            self.lost += message.sequence - self._next_sequence
        self._next_sequence = message.sequence + 1
        return message

    def _wanted(self, message):
        return True

    def __iter__(self):
        while (result := self.receive(self.timeout_s)) is not None:
            yield result


class Results(Subscriber):
    """Receives results. state: the latest state message, with model and method; None before the first one."""

    def __init__(self, endpoint, timeout_s=None, server_key=None, key=None):
        self.state = None
        super().__init__(endpoint, timeout_s, server_key, key, decode=decode_result, held=10_000, most_bytes=most_result_bytes)

    def _wanted(self, message):
        if message.kind == "state":
            self.state = message
        return message.kind == "result"


class Inferences(Subscriber):
    """Receives the inferences of an lbea-serve with --infer and --inference."""

    def __init__(self, endpoint, timeout_s=None, server_key=None, key=None):
        super().__init__(endpoint, timeout_s, server_key, key, decode=decode_inference, held=100, most_bytes=most_inference_bytes)


class FrameSender(Closing):
    """Sends clouds to a running lbea-serve, and reports to it: hello at the start, heartbeats in pauses, captures without room,
    goodbye at the end. sent, refused: numbers of frames that were sent, and that could not be sent."""

    def __init__(self, endpoint, wait_s=5, server_key=None, key=None):
        """Waits up to wait_s seconds for the receiver; raises TimeoutError when there is none. Keys as for Results."""
        self.session, self.next_id, self.sent, self.refused, self._withheld = secrets.randbits(64), 0, 0, 0, 0
        self.socket = make_socket(zmq.PUSH, 16, most_frame_bytes, linger_ms=5000, keys=client_keys(server_key, key))
        self.socket.connect(endpoint)
        if not self.socket.poll(1000 * wait_s, zmq.POLLOUT):
            self.socket.close(linger=0)
            raise TimeoutError(f"{endpoint}: no program receives frames there; start lbea-serve")
        self._lock, self._closing, self._last_message = threading.Lock(), threading.Event(), 0
        self._report("hello", 1)
        threading.Thread(target=call_repeatedly, args=(weakref.WeakMethod(self._keep_alive), self._closing), daemon=True).start()

    def send(self, points, stamp_ns=None, timeout_s=0):
        """Sends a frame. points: n x 3. stamp_ns: default now. Returns False when the receiver's queue is full."""
        message = encode_frame(points, time.time_ns() if stamp_ns is None else stamp_ns, self.next_id, self.session)
        with self._lock:
            sent = (not self._withheld or self._report("heartbeat", timeout_s)) and self._push(message, timeout_s)
            self.next_id += 1  # also for a frame that cannot be sent: the receiver counts it
            self.sent, self.refused, self._withheld = self.sent + sent, self.refused + (not sent), self._withheld + (not sent)
        return sent

    def end(self):
        """Marks the end of the test."""
        with self._lock:
            self.socket.send(encode_end_of_stream(self.next_id, self.session))

    def close(self):
        """Sends goodbye with the number of the last captures that could not be sent, so that the receiver counts them."""
        self._closing.set()
        with self._lock:
            if not self.socket.closed:
                self._report("goodbye", 1)
            super().close()

    def _keep_alive(self):
        with self._lock:
            if not self.socket.closed and time.monotonic() - self._last_message >= heartbeat_s:
                self._report("heartbeat", 0)

    def _report(self, kind, timeout_s):
        sent = self._push(encode_control(kind, self.next_id, self._withheld, self.session), timeout_s)
        self._withheld = 0 if sent else self._withheld
        return sent

    def _push(self, message, timeout_s):
        self._last_message = time.monotonic()
        if not self.socket.poll(1000 * timeout_s, zmq.POLLOUT):
            return False
        self.socket.send(message, copy=False)
        return True


def call_repeatedly(method, stop):
    """Until `stop` is set or the object of the weak method is gone."""
    while not stop.wait(heartbeat_s) and (bound := method()) is not None:
        bound()
        del bound


class FrameReceiver(Closing):
    """Receives frames instead of lbea-serve: iterate over it, or call receive().

    A second receiver would take every other frame. Therefore an ipc endpoint is locked, as lbea-serve locks it.
    """

    def __init__(self, endpoint, timeout_s=None):
        self.timeout_s, self.damaged = timeout_s, 0
        self._lock = lock(endpoint)
        self.socket = make_socket(zmq.PULL, 16, most_frame_bytes)
        self.socket.bind(endpoint)

    def receive(self, timeout_s=None):
        """Returns the next Frame, including the end of a stream; None when none arrives within timeout_s seconds."""
        while self.socket.poll(None if timeout_s is None else 1000 * timeout_s):
            message = self.socket.recv()
            if is_control(message):
                continue
            try:
                return decode_frame(message)
            except DamagedMessage:
                self.damaged += 1
        return None

    def __iter__(self):
        while (frame := self.receive(self.timeout_s)) is not None and not frame.end_of_stream:
            yield frame

    def close(self):
        super().close()
        if self._lock:
            name, descriptor = self._lock
            os.unlink(name)
            os.close(descriptor)
            self._lock = None


def lock(endpoint):
    """Locks an ipc endpoint with a lock file: ZeroMQ silently lets a second process take over an ipc path."""
    if not endpoint.startswith("ipc://"):
        if not endpoint.startswith(("tcp://127.", "inproc://")):
            raise ValueError(f"{endpoint}: only this machine may connect without authentication; use tcp://127.0.0.1:PORT")
        return None
    path = endpoint[len("ipc://"):]
    descriptor = os.open(path + ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise FileExistsError(f"{endpoint} is in use by another process; stop it or choose another path") from None
    if os.path.lexists(path) and not stat.S_ISSOCK(os.lstat(path).st_mode):
        os.unlink(path + ".lock")
        os.close(descriptor)
        raise FileExistsError(f"{endpoint}: {path} exists and is not a socket; choose another path")
    return path + ".lock", descriptor
