"""The wire in plain Python, against a real lbea-serve and lbea-send: programs, model and clouds come in the environment."""
import json
import os
import random
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path
from types import SimpleNamespace

import numpy

import lbea_client

SERVE, SEND, KEYGEN, MODEL, OTHER_MODEL, SENSOR, FRAMES = (os.environ[name] for name in ("LBEA_SERVE", "LBEA_SEND", "LBEA_KEYGEN", "LBEA_DEMO",
                                                                                         "LBEA_OTHER_MODEL", "LBEA_SENSOR", "LBEA_FRAMES"))
CORPUS = Path(os.environ["LBEA_FUZZ_CORPUS"])


def moved_in_x(model, sample, node_id):
    """Displacement of a node since the first state of the sample's run."""
    simulation, node = model.samples[sample][0], model.node_ids.tolist().index(node_id)
    first = model.samples.tolist().index([simulation, 0])
    return float(model.node_positions(sample)[node][0]) - float(model.node_positions(first)[node][0])


class MessageTest(unittest.TestCase):
    def test_frames_come_back_as_they_went(self):
        for count in (0, 1, 2, 5000):
            points = numpy.random.default_rng(count).normal(size=(count, 3)).astype(numpy.float32)
            frame = lbea_client.decode_frame(lbea_client.encode_frame(points, 1_234_567_890_123, 7, 2**64 - 1, "left"))
            self.assertEqual((frame.session, frame.id, frame.stamp_ns, frame.frame_id), (2**64 - 1, 7, 1_234_567_890_123, "left"))
            self.assertFalse(frame.end_of_stream)
            self.assertTrue((frame.points == points).all() and frame.points.shape == (count, 3))
        end = lbea_client.decode_frame(lbea_client.encode_end_of_stream(9, 5))
        self.assertEqual((end.end_of_stream, end.id, end.session), (True, 9, 5))

    def test_what_cannot_be_sent_is_refused(self):
        for points in (numpy.zeros(3), numpy.zeros((2, 2)), [[["x"]]]):
            with self.assertRaises(ValueError):
                lbea_client.encode_frame(points, 0, 0, 0)
        for stamp in (-1, 2**32 * 10**9):
            with self.assertRaises(ValueError):
                lbea_client.encode_frame(numpy.zeros((1, 3)), stamp, 0, 0)

    def test_any_stride_and_further_fields(self):
        frame = lbea_client.decode_frame((CORPUS / "frame/odd_stride_extra_field_pose.bin").read_bytes())
        self.assertEqual(frame.points.shape[1], 3)
        self.assertGreater(len(frame.points), 0)
        nine = lbea_client.decode_frame((CORPUS / "frame/nine_points.bin").read_bytes())
        self.assertEqual(nine.points.shape, (9, 3))

    def test_damaged_messages_raise_one_exception_only(self):
        dice = random.Random(1)
        seeds = [(path.read_bytes(), decode) for folder, decode in (("frame", lbea_client.decode_frame), ("result", lbea_client.decode_result))
                 for path in sorted((CORPUS / folder).iterdir())]
        refused = 0
        for seed, decode in seeds:
            for _ in range(300):
                message = bytearray(seed)
                for _ in range(dice.randint(1, 8)):
                    if message:
                        message[dice.randrange(len(message))] = dice.choice((0, 1, 0x7F, 0xFF, dice.randrange(256)))
                message = bytes(message[:dice.randint(0, len(message))] if dice.random() < 0.3 else message)
                try:
                    decode(message)
                except lbea_client.DamagedMessage:
                    refused += 1
        self.assertGreater(refused, 100)


class LiveTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.frames, self.results = (f"ipc://{self.folder.name}/{name}" for name in ("frames", "results"))

    def start(self, *command):
        log = open(os.path.join(self.folder.name, "log"), "w+")
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        self.addCleanup(log.close)
        self.addCleanup(process.stdout.close)
        self.addCleanup(lambda: process.poll() is None and (process.kill(), process.wait()))
        return process, log

    def serve(self, *more):
        server, log = self.start(SERVE, MODEL, "--frames", self.frames, "--results", self.results, *more)
        deadline = time.monotonic() + 30
        while "ready" not in Path(log.name).read_text():
            self.assertLess(time.monotonic(), deadline, Path(log.name).read_text())
            time.sleep(0.01)
        return server

    def test_sends_to_the_matcher_and_reads_its_results(self):
        lbea = __import__("lbea")
        model, server = lbea.Model(MODEL), self.serve()
        with lbea_client.Results(self.results, timeout_s=30) as results, lbea_client.FrameSender(self.frames) as sender:
            while results.state is None:
                results.receive(0.1)
            self.assertEqual(results.state.model.samples, len(model.samples))
            self.assertEqual(results.state.model.simulations, model.simulations)
            self.assertEqual(results.state.model.checksum, model.checksum)
            chosen = [len(model.samples) // 3, len(model.samples) // 2, len(model.samples) - 1]
            for sample in chosen:
                self.assertTrue(sender.send(model.node_positions(sample), stamp_ns=1_000_000 + sample, timeout_s=5))
            for expected_id, (sample, result) in enumerate(zip(chosen, results)):
                self.assertEqual((result.frame_id, result.stamp_ns), (expected_id, 1_000_000 + sample))
                self.assertIn(result.status, ("ok", "low_coverage"))
                best = result.matches[0]
                self.assertEqual([best.simulation, best.time_step], model.samples[sample].tolist())
                self.assertEqual(best.simulation_name, model.simulations[best.simulation])
                self.assertEqual([(channel.name, channel.unit) for channel in result.channels], [("struck end", "mm"), ("struck end, velocity", "mm/s")])
                self.assertAlmostEqual(result.channels[0].value, moved_in_x(model, sample, 2409), places=3)
                self.assertEqual(result.points.received, model.nodes)
                self.assertEqual(result.session, sender.session)
                self.assertIn(result.counters.received, range(expected_id + 1, 4))
            self.assertEqual((results.lost, results.damaged, sender.sent, sender.refused), (0, 0, 3, 0))
            sender.send(numpy.zeros((0, 3)), timeout_s=5)
            refused = results.receive(30)
            self.assertEqual((refused.status, refused.matches, refused.channels), ("empty_frame", [], []))
            sender.close()
            while not results.state.senders or results.state.senders[0].condition == "active":
                results.receive(0.1)
            of_us = results.state.senders[0]
            self.assertEqual((of_us.session, of_us.next_id, of_us.received, of_us.missed, of_us.condition), (sender.session, 4, 4, 0, "ended"))
        server.send_signal(signal.SIGINT)
        self.assertEqual(server.wait(30), 0)
        self.assertIn("received 4", server.stdout.read())

    def test_results_before_the_first_call_arrive(self):
        """They were lost without a count: the subscription was sent in the first poll."""
        self.serve()
        with lbea_client.Results(self.results) as results, lbea_client.Results(self.results) as watcher:
            while watcher.state is None:
                watcher.receive(0.1)
            time.sleep(0.5)
            with lbea_client.FrameSender(self.frames) as sender:
                for _ in range(3):
                    sender.send(numpy.zeros((0, 3)), timeout_s=5)
                self.assertEqual([watcher.receive(30).frame_id for _ in range(3)], [0, 1, 2])
            self.assertEqual([results.receive(30).frame_id for _ in range(3)], [0, 1, 2])
            self.assertEqual(results.lost, 0)

    def test_reads_what_the_cameras_cannot_see(self):
        lbea, endpoint = __import__("lbea"), f"ipc://{self.folder.name}/inference"
        model = lbea.Model(MODEL)
        self.serve("--method", "fit", "--infer", "plastic_strain", "--inference", endpoint, "--pose", SENSOR)
        T = numpy.array(json.loads(Path(SENSOR).read_text())["T_reference_sensor"], float).reshape(-1, 4)[:3]
        with lbea_client.Inferences(endpoint) as inferences, lbea_client.FrameSender(self.frames) as sender:
            inference, sent = None, 0
            while inference is None and sent < 100:  # until the subscription has got through
                sender.send((model.node_positions(sent) - T[:, 3]) @ T[:, :3], timeout_s=5)
                sent, inference = sent + 1, inferences.receive(0.2)
            self.assertEqual((inference.field, inference.location, inference.session), ("plastic_strain", "element", sender.session))
            self.assertEqual((inference.values.shape, inference.spread.shape), ((model.elements,), (model.elements,)))
            self.assertIn(len(inference.bound_90), (0, model.elements))
            self.assertEqual((inference.model_checksum, inference.component, inferences.damaged), (model.checksum, "", 0))
            self.assertTrue((inference.spread >= 0).all() and numpy.isfinite(inference.values).all())

    def test_names_the_component_whose_field_it_is(self):
        endpoint, elements = f"ipc://{self.folder.name}/inference", __import__("lbea").Model(MODEL).elements
        self.serve(OTHER_MODEL, "--method", "fit", "--infer", "plastic_strain", "--inference", endpoint, "--pose", SENSOR)
        clouds = [numpy.frombuffer(file.read_bytes().split(b"end_header\n", 1)[1], "<f4").reshape(-1, 3) for file in sorted(Path(FRAMES).glob("*.ply"))]
        with lbea_client.Inferences(endpoint) as inferences, lbea_client.FrameSender(self.frames) as sender:
            found, sent = {}, 0
            while len(found) < 2 and sent < 100:  # until the subscription has got through
                sender.send(clouds[0], timeout_s=5)
                sent += 1
                while (inference := inferences.receive(0.2)) is not None:
                    found[inference.component] = inference
        self.assertEqual(set(found), {"rail", "other"})
        self.assertNotEqual(found["rail"].model_checksum, found["other"].model_checksum)
        self.assertEqual([len(inference.values) for inference in found.values()], [elements, elements])

    def test_reads_how_the_test_will_end(self):
        self.serve("--method", "fit", "--pose", SENSOR, "--trigger-ns", "1000000000")
        with lbea_client.Results(self.results, timeout_s=30) as results, lbea_client.FrameSender(self.frames) as sender:
            while results.state is None:
                results.receive(0.1)
            for i, file in enumerate(sorted(Path(FRAMES).glob("*.ply"))):  # every fourth state of a run
                points = numpy.frombuffer(file.read_bytes().split(b"end_header\n", 1)[1], "<f4").reshape(-1, 3)
                sender.send(points, stamp_ns=1_000_000_000 + 3_000_000 * i, timeout_s=5)
            forecast = [results.receive(30) for _ in range(4)][-1].forecast
        model = __import__("lbea").Model(MODEL)
        self.assertEqual((forecast.frames, len(forecast.parameters)), (4, len(model.parameters(0))))
        self.assertGreater(forecast.error_90, 0)
        self.assertAlmostEqual(sum(run.weight for run in forecast.runs), 1, places=3)
        self.assertTrue({run.simulation for run in forecast.runs} <= set(range(len(model.simulations))))
        self.assertAlmostEqual(sum(forecast.branches), 1, places=4)
        for parameter in forecast.parameters:
            self.assertGreater(parameter.bound_90, 0)
            self.assertLessEqual(parameter.r2, 1)

    def test_receives_what_lbea_send_sends(self):
        clouds = []
        for i in range(3):
            points = numpy.random.default_rng(i).uniform(-100, 100, (10 + i, 3)).round(3).astype(numpy.float32)
            numpy.savetxt(os.path.join(self.folder.name, f"cloud_{i}.xyz"), points, fmt="%.9g")
            clouds.append(points)
        with lbea_client.FrameReceiver(self.frames, timeout_s=30) as receiver:
            with self.assertRaises(FileExistsError):
                lbea_client.FrameReceiver(self.frames)
            sender, _ = self.start(SEND, *(os.path.join(self.folder.name, f"cloud_{i}.xyz") for i in range(3)), "--to", self.frames,
                                   "--end-of-stream")
            received = list(receiver)
            self.assertEqual(sender.wait(30), 0)
            self.assertEqual(receiver.damaged, 0)
        self.assertEqual([frame.id for frame in received], [0, 1, 2])
        for frame, points in zip(received, clouds):
            numpy.testing.assert_array_equal(frame.points, points)

    def test_a_pausing_sender_stays_known_and_tells_what_it_withheld(self):
        """The sender sent nothing in pauses, so that the matcher called it silent after 3 s, and never told what it had withheld
        before a frame that was sent: the matcher counted these captures as lost on the way."""
        with lbea_client.FrameReceiver(self.frames) as receiver, lbea_client.FrameSender(self.frames) as sender:
            while self.control(receiver).kind != 1:
                pass
            sender.socket.poll, poll = lambda *_: 0, sender.socket.poll
            self.assertFalse(sender.send(numpy.zeros((1, 3))))
            sender.socket.poll = poll
            while (report := self.control(receiver)).next_id == 0:
                pass
            self.assertEqual((report.session, report.kind, report.next_id, report.withheld), (sender.session, 1, 1, 1))
            sender.close()
            while (report := self.control(receiver)).kind != 2:
                pass
            self.assertEqual((report.next_id, report.withheld), (1, 0))

    def control(self, receiver):
        self.assertTrue(receiver.socket.poll(30_000))
        found = lbea_client.messages.Control.ControlT.InitFromObj(
            lbea_client.messages.Control.Control.GetRootAs(receiver.socket.recv()))
        return SimpleNamespace(session=found.session, kind=found.kind, next_id=found.nextId, withheld=found.withheld)

    def test_keys_open_a_matcher_that_has_them(self):
        server, user, stranger = (os.path.join(self.folder.name, name) for name in ("server", "user", "stranger"))
        for base in (server, user, stranger):
            subprocess.run([KEYGEN, base], check=True, stdout=subprocess.DEVNULL)
        self.serve("--key", server + ".key", "--allow", user + ".pub")
        with lbea_client.Results(self.results, server_key=server + ".pub", key=user + ".key") as results:
            while results.state is None:
                results.receive(0.1)
        for keys in ({}, {"server_key": server + ".pub"}, {"server_key": server + ".pub", "key": stranger + ".key"}):
            with lbea_client.Results(self.results, **keys) as results:
                self.assertIsNone(results.receive(1.5))
                self.assertIsNone(results.state)
        with self.assertRaises(ValueError):
            lbea_client.Results(self.results, key=user + ".key")
        with self.assertRaises(ValueError):
            lbea_client.Results(self.results, server_key=__file__)

    def test_nobody_there_is_said_at_once(self):
        with self.assertRaises(TimeoutError):
            lbea_client.FrameSender(self.frames, wait_s=0.1)
        with lbea_client.Results(self.results) as results:
            self.assertIsNone(results.receive(0.1))
        with self.assertRaises(ValueError):
            lbea_client.FrameReceiver("tcp://0.0.0.0:5555")
        Path(self.folder.name, "frames").write_text("mine")
        with self.assertRaises(FileExistsError):
            lbea_client.FrameReceiver(self.frames)
        self.assertEqual(Path(self.folder.name, "frames").read_text(), "mine")


if __name__ == "__main__":
    unittest.main()
