"""The matcher from Python. In the environment: models of bending plates and of the demo (baked with views), the demo's sensor and
frames of a run that is not in its model."""
import gc
import json
import math
import os
import sys
import threading
import time
import unittest
from pathlib import Path

import numpy

import lbea

PLATES, DEMO, SENSOR, FRAMES = (os.environ[name] for name in ("LBEA_PLATES", "LBEA_DEMO", "LBEA_SENSOR", "LBEA_FRAMES"))


class ModelTest(unittest.TestCase):
    def setUp(self):
        self.model = lbea.Model(PLATES)

    def test_tells_what_it_holds(self):
        m = self.model
        self.assertEqual((m.nodes, m.elements, m.vertices, m.modes, m.references, m.length_unit), (200, 171, 200, 20, 1, "mm"))
        self.assertEqual(m.simulations, [f"plate_{i}" for i in range(4)])
        self.assertEqual(m.samples.tolist(), [[run, step] for run in range(4) for step in range(6)])
        self.assertEqual(m.sample_times_s.shape, (24,))
        self.assertAlmostEqual(m.parameters(2)["final_angle [rad]"], 0.8 + 0.37 * 2)
        self.assertEqual(m.element_nodes.shape, (171, 4))
        self.assertLess(m.element_nodes.max(), m.nodes)
        self.assertEqual((len(set(m.node_ids)), len(set(m.element_ids)), m.element_parts.shape), (200, 171, (171,)))
        self.assertTrue((numpy.diff(m.eigenvalues()) >= 0).all())
        for field in m.fields:
            self.assertIn(m.field_values(field, 23).size, (m.nodes, m.elements))

    def test_arrays_are_views_that_cannot_be_written_and_keep_the_model(self):
        positions, again = self.model.node_positions(23), self.model.node_positions(23)
        self.assertEqual((positions.shape, positions.dtype), ((200, 3), numpy.float32))
        self.assertTrue(numpy.shares_memory(positions, again))
        with self.assertRaises(ValueError):
            positions[0, 0] = 1
        before = positions.copy()
        del again, self.model
        gc.collect()
        self.assertTrue((positions == before).all())

    def test_fields_in_16_bits_are_read(self):
        compact = lbea.Model(PLATES + ".compact")
        self.assertEqual(self.model.field_error("plastic_strain"), 0)
        error = compact.field_error("plastic_strain")
        self.assertGreater(error, 0)
        for sample in range(24):
            exact, rounded = self.model.field_values("plastic_strain", sample), compact.field_values("plastic_strain", sample)
            self.assertEqual((rounded.shape, rounded.dtype), (exact.shape, numpy.float32))
            self.assertLessEqual(abs(rounded - exact).max(), error)

    def test_what_is_not_there_is_refused(self):
        with self.assertRaises(IndexError):
            self.model.node_positions(24)
        with self.assertRaises(IndexError):
            self.model.parameters(4)
        with self.assertRaises(KeyError):
            self.model.field_values("no such field", 0)
        for file, status in (("/no/such.lbea", "file_not_found"), (__file__, "not_a_model")):
            with self.assertRaises(lbea.Error) as caught:
                lbea.Model(file)
            self.assertEqual(caught.exception.status, status)
            self.assertIn(file, str(caught.exception))


class MatcherTest(unittest.TestCase):
    def setUp(self):
        self.model = lbea.Model(PLATES)

    def test_a_sample_finds_itself(self):
        for method in ("lbea", "vtp"):
            matcher = lbea.Matcher(self.model, method, max_matches=3)
            for sample in (5, 11, 17, 23):
                result = matcher.match(self.model.node_positions(sample), id=sample, stamp_ns=-7)
                self.assertEqual((result.status, result.frame_id, result.stamp_ns, result.verdict), ("ok", sample, -7, "unknown"))
                best = result.matches[0]
                self.assertEqual((best.sample, best.simulation, best.time_step), (sample, sample // 6, sample % 6))
                self.assertEqual(best.simulation_name, f"plate_{sample // 6}")
                self.assertEqual(best.time_s, self.model.sample_times_s[sample])
                self.assertEqual(len(result.matches), 3)
                self.assertEqual((result.points["used"], result.coefficients.shape), (200, (20, 3)))

    def test_channels_are_those_of_the_best_sample(self):
        self.assertEqual(self.model.channels, ["free end"])
        result = lbea.Matcher(self.model).match(self.model.node_positions(11))
        (channel,) = result.channels
        self.assertEqual((channel.name, channel.unit), ("free end", "mm"))
        self.assertAlmostEqual(channel.value, float(self.model.node_positions(11)[19][2]), places=4)
        self.assertTrue(math.isnan(channel.bound_90))

    def test_results_outlive_the_next_match(self):
        matcher = lbea.Matcher(self.model)
        first = matcher.match(self.model.node_positions(5))
        coefficients = first.coefficients.copy()
        matcher.match(self.model.node_positions(23))
        self.assertTrue((first.coefficients == coefficients).all())
        self.assertEqual(first.matches[0].sample, 5)

    def test_pose_is_applied(self):
        angle, shift = 0.3, numpy.array([10.0, -20.0, 5.0])
        rotation = numpy.array([[numpy.cos(angle), -numpy.sin(angle), 0], [numpy.sin(angle), numpy.cos(angle), 0], [0, 0, 1]])
        seen = ((self.model.node_positions(17) - shift) @ rotation).astype(numpy.float32)
        pose = numpy.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, shift
        for T in (pose, pose[:3]):
            self.assertEqual(lbea.Matcher(self.model, T_reference_sensor=T).match(seen).matches[0].sample, 17)

    def test_arrays_that_would_have_to_be_copied_are_refused(self):
        matcher = lbea.Matcher(self.model)
        good = self.model.node_positions(9)
        for bad in (good.astype(float), numpy.asfortranarray(good), good[:, ::-1], good.tolist(), None):
            with self.assertRaises(TypeError):
                matcher.match(bad)
        for bad in (good.reshape(-1), good.reshape(100, 6), good.reshape(2, 100, 3)):
            with self.assertRaises(ValueError):
                matcher.match(bad)
        self.assertEqual(matcher.match(good[:0]).status, "empty_frame")
        self.assertEqual(matcher.match(good[50:]).points["received"], 150)
        self.assertEqual(matcher.match(numpy.full((3, 3), numpy.nan, numpy.float32)).points["invalid"], 3)

    def test_unaligned_arrays_and_transposed_poses_are_refused(self):
        unaligned = numpy.ndarray((4, 3), "f4", bytes(64), 1)
        with self.assertRaisesRegex(ValueError, "aligned"):
            lbea.Matcher(self.model).match(unaligned)
        pose = numpy.eye(4)
        pose[:3, 3] = 5, 6, 7
        lbea.Matcher(self.model, "lbea", T_reference_sensor=pose)
        with self.assertRaisesRegex(ValueError, "last row"):
            lbea.Matcher(self.model, "lbea", T_reference_sensor=pose.T)

    def test_what_to_do_with_other_arrays_is_said(self):
        matcher, good = lbea.Matcher(self.model), self.model.node_positions(9)
        for bad, found in ((good.astype(float), "float64"), (numpy.asfortranarray(good), "float32"), (good.tolist(), "list")):
            with self.assertRaisesRegex(TypeError, rf"^points \({found}\): needs float32, n x 3, contiguous; (numpy.asarray.*)$") as refused:
                matcher.match(bad)
            remedy = str(refused.exception).split("; ")[1]
            self.assertEqual(matcher.match(eval(remedy, {"numpy": numpy, "points": bad})).matches[0].sample, 9)

    def test_masks_are_not_ignored(self):
        masked = numpy.ma.array(self.model.node_positions(9), mask=True)
        with self.assertRaisesRegex(TypeError, "masked"):
            lbea.Matcher(self.model).match(masked)

    def test_settings_are_checked(self):
        for settings, error in (({"max_points": 0}, lbea.Error), ({"method": "fit"}, lbea.Error), ({"method": "icp"}, ValueError),
                                ({"max_poinst": 5}, TypeError), ({"T_reference_sensor": numpy.eye(3)}, ValueError),
                                ({"T_reference_sensor": 2 * numpy.eye(4)[:3]}, lbea.Error), ({"max_points": -1}, RuntimeError)):
            with self.assertRaises(error, msg=str(settings)):
                lbea.Matcher(self.model, **settings)
        self.assertEqual(lbea.Matcher(self.model, max_points=199).match(self.model.node_positions(0)).status, "too_many_points")

    def test_fit_tells_its_candidates(self):
        model = lbea.Model(DEMO)
        matcher = lbea.Matcher(model, "fit")
        result = matcher.match(model.node_positions(len(model.samples) - 1))
        self.assertGreater(len(result.candidates), 1)
        self.assertEqual(result.candidates[0].distance, result.residual)
        self.assertAlmostEqual(sum(share.weight for share in result.estimate), 1, places=4)
        self.assertGreater(result.elapsed_ns["fit"], 0)


def cloud_of(file):
    """The points of a binary PLY file whose vertices are x, y, z as float."""
    return numpy.frombuffer(file.read_bytes().split(b"end_header\n", 1)[1], "<f4").reshape(-1, 3)


class TestHistoryTest(unittest.TestCase):
    def test_a_wrong_pose_is_corrected(self):
        model, T, shift = lbea.Model(DEMO), lbea.read_pose(SENSOR), numpy.array([3.0, 0, 4])
        T[:3, 3] += shift
        alone, matcher = (lbea.Matcher(model, "fit", T_reference_sensor=T) for _ in range(2))
        history = lbea.TestHistory(model)
        self.assertIs(history.estimates_pose, True)
        numpy.testing.assert_array_equal(history.pose_correction, numpy.eye(4))
        for file in sorted(Path(FRAMES).glob("*.ply")):
            cloud = cloud_of(file)
            without, corrected = alone.match(cloud), matcher.match(cloud, history=history)
            self.assertTrue(numpy.isnan([without.pose_turn, without.pose_shift]).all())
            self.assertEqual(corrected.status, "ok")
            self.assertAlmostEqual(corrected.pose_shift, 5, delta=1.5)
            self.assertLess(corrected.pose_turn, 1)
            self.assertLess(corrected.residual, without.residual)
        correction, nodes = history.pose_correction, model.node_positions(0)
        self.assertEqual((correction.shape, correction.dtype), ((4, 4), numpy.float64))
        left = (nodes + shift) @ correction[:3, :3].T + correction[:3, 3] - nodes
        self.assertLess(numpy.linalg.norm(left, axis=1).max(), 5 / 2)
        history.reset()
        numpy.testing.assert_array_equal(history.pose_correction, numpy.eye(4))
        self.assertFalse((correction == numpy.eye(4)).all(), "an earlier correction is a copy")
        history.fix_pose()
        self.assertIs(history.estimates_pose, False)
        history.set_impact(5_000_000)
        result = matcher.match(cloud, stamp_ns=7_000_000, history=history)
        self.assertAlmostEqual(result.test_time, 2e-3, places=6)
        self.assertTrue(numpy.isnan(result.pose_shift))

    def test_where_it_is_not_estimated_frames_are_matched_as_without(self):
        for file, is_estimated in ((PLATES, False), (DEMO, True)):
            model = lbea.Model(file)
            history, matcher, points = lbea.TestHistory(model), lbea.Matcher(model), model.node_positions(9)
            self.assertIs(history.estimates_pose, is_estimated)
            for given in (history, None):
                result = matcher.match(points, id=3, history=given)
                self.assertEqual((result.status, result.frame_id, result.matches[0].sample), ("ok", 3, 9))
                self.assertTrue(numpy.isnan(result.pose_shift))
            numpy.testing.assert_array_equal(history.pose_correction, numpy.eye(4))

    def test_other_models_and_types_are_refused(self):
        model = lbea.Model(PLATES)
        matcher, points = lbea.Matcher(model), model.node_positions(9)
        with self.assertRaisesRegex(ValueError, "another model"):
            matcher.match(points, history=lbea.TestHistory(lbea.Model(DEMO)))
        for bad in (numpy.eye(4), model):
            with self.assertRaises(TypeError):
                matcher.match(points, history=bad)
        with self.assertRaises(TypeError):
            lbea.TestHistory(None)
        self.assertEqual(matcher.match(points, history=lbea.TestHistory(lbea.Model(PLATES))).matches[0].sample, 9)


class RigMatcherTest(unittest.TestCase):
    """Two rigs, each of which sees every second point of the demo's frames."""

    def setUp(self):
        self.model, self.pose = lbea.Model(DEMO), lbea.read_pose(SENSOR)
        self.clouds = [cloud_of(file) for file in sorted(Path(FRAMES).glob("*.ply"))]

    def halves(self, cloud):
        return [numpy.ascontiguousarray(cloud[rig::2]) for rig in range(2)]

    def test_one_answer_rests_on_both(self):
        matcher, forecast = lbea.RigMatcher(self.model, [self.pose] * 2, max_matches=3), lbea.Forecast(self.model)
        alone = lbea.Matcher(self.model, "fit", T_reference_sensor=self.pose)
        for i, cloud in enumerate(self.clouds):
            halves = self.halves(cloud)
            result = matcher.match(halves, ids=[i, i + 10], stamps_ns=[3_000_000 * i] * 2)
            self.assertEqual((result.status, result.frame_id, result.stamp_ns, len(result.matches)), ("ok", i, 3_000_000 * i, 3))
            self.assertEqual(result.points["received"], sum(map(len, halves)))
            self.assertAlmostEqual(sum(share.weight for share in result.estimate), 1, places=4)
            for rig, half in zip(result.rigs, halves):
                self.assertEqual((rig.status, rig.is_used, rig.points["received"]), ("ok", True, len(half)))
                self.assertEqual(rig.clock_correction_ns, 0)
                self.assertGreater(rig.coverage, 0.25)
                self.assertTrue(numpy.isfinite([rig.residual, rig.misfit, rig.pose_shift]).all())
                self.assertEqual((rig.pose_correction.shape, rig.pose_correction.dtype), ((4, 4), numpy.float64))
            forecast.update(result)
        self.assertGreater(forecast.frames, 0)
        self.assertEqual(alone.match(cloud).rigs, [])

    def test_rigs_without_a_frame_count_as_absent(self):
        matcher = lbea.RigMatcher(self.model, [self.pose] * 2, clock_offsets_ns=[0, -5])
        halves = self.halves(self.clouds[-1])
        for absent in (0, 1):
            given = list(halves)
            given[absent] = None
            result = matcher.match(given, stamps_ns=[0, 5])
            self.assertEqual((result.status, result.stamp_ns), ("ok", 0))
            self.assertEqual([rig.is_used for rig in result.rigs], [rig != absent for rig in range(2)])
            self.assertEqual(result.rigs[absent].status, "empty_frame")
        self.assertEqual(matcher.match([None, halves[0][:0]]).status, "empty_frame")

    def test_poses_impact_and_reset(self):
        matcher, wrong = lbea.RigMatcher(self.model, [self.pose] * 2), self.pose.copy()
        wrong[:3, 3] += 3, 0, 4
        corrected = lbea.RigMatcher(self.model, [self.pose, wrong])
        for cloud in self.clouds:
            result = corrected.match(self.halves(cloud))
        self.assertAlmostEqual(result.rigs[1].pose_shift, 5, delta=1.5)
        self.assertFalse((result.rigs[1].pose_correction == numpy.eye(4)).all())
        corrected.reset()
        numpy.testing.assert_array_equal(corrected.match([None, None]).rigs[1].pose_correction, numpy.eye(4))
        matcher.fix_poses()
        matcher.set_impact(5_000_000)
        result = matcher.match(self.halves(self.clouds[-1]), stamps_ns=[7_000_000] * 2)
        self.assertAlmostEqual(result.test_time, 2e-3, places=6)
        self.assertTrue(numpy.isnan([rig.pose_shift for rig in result.rigs]).all())

    def test_what_does_not_fit_is_refused(self):
        model, pose = self.model, self.pose
        for arguments, error, words in ((([],), lbea.Error, "0 rigs"), (([pose] * 17,), lbea.Error, "17 rigs"),
                                        (([pose, 2 * pose[:3]],), lbea.Error, "rig 2"), (([pose, numpy.eye(3)],), ValueError, "3 x 4"),
                                        (([pose] * 2, [0]), ValueError, "clock_offsets_ns has 1")):
            with self.assertRaisesRegex(error, words):
                lbea.RigMatcher(model, *arguments)
        with self.assertRaisesRegex(lbea.Error, "without a sensor"):
            lbea.RigMatcher(lbea.Model(PLATES), [pose])
        with self.assertRaisesRegex(TypeError, "RigMatcher has no setting 'max_poinst'"):
            lbea.RigMatcher(model, [pose], max_poinst=5)
        matcher, halves = lbea.RigMatcher(model, [pose] * 2), self.halves(self.clouds[0])
        for arguments, words in (((halves[:1],), "points has 1"), ((halves, [1]), "ids has 1"), ((halves, None, [1] * 3), "stamps_ns has 3")):
            with self.assertRaisesRegex(ValueError, words):
                matcher.match(*arguments)
        self.assertEqual(matcher.match(halves, [2**64 - 1, 0]).frame_id, 2**64 - 1)
        for ids in ([-1, 0], [2**64, 0]):
            with self.assertRaises(TypeError):
                matcher.match(halves, ids)
        with self.assertRaisesRegex(TypeError, "float64"):
            matcher.match([halves[0], halves[1].astype(float)])


class ForecastTest(unittest.TestCase):
    def test_frames_tell_the_end(self):
        model = lbea.Model(DEMO)
        self.assertTrue(lbea.Forecast.is_in(model))
        matcher, history, forecast = lbea.Matcher(model, "fit", T_reference_sensor=lbea.read_pose(SENSOR)), lbea.TestHistory(model), lbea.Forecast(model)
        history.set_impact(0)
        prior = forecast.parameters
        self.assertEqual((forecast.frames, list(prior)), (0, list(model.parameters(0))))
        self.assertFalse(any(parameter.is_identifiable for parameter in prior.values()))
        numpy.testing.assert_allclose(forecast.run_weights, 1 / len(model.simulations), rtol=1e-5)
        for i, file in enumerate(sorted(Path(FRAMES).glob("*.ply"))):  # every fourth state of a run
            forecast.update(matcher.match(cloud_of(file), stamp_ns=3_000_000 * i, history=history))
        self.assertEqual(forecast.frames, 4)
        self.assertAlmostEqual(forecast.test_time_s, 9e-3, places=4)
        self.assertAlmostEqual(forecast.run_weights.sum(), 1, places=3)
        self.assertAlmostEqual(sum(forecast.branch_probabilities), 1, places=4)
        self.assertGreater(forecast.error_90, 0)
        for name, parameter in forecast.parameters.items():
            self.assertEqual(parameter.is_identifiable, parameter.r2 >= numpy.float32(0.2), name)
            self.assertGreater(parameter.bound_90, 0)
        last = [max(s for s, (run, _) in enumerate(model.samples) if run == r) for r in range(len(model.simulations))]
        expected = sum(float(w) * model.node_positions(s).astype(float) for w, s in zip(forecast.run_weights, last))
        numpy.testing.assert_allclose(forecast.final_positions(), expected, atol=1e-2)
        forecast.reset()
        self.assertEqual(forecast.frames, 0)

    def test_what_cannot_be_forecast_is_refused(self):
        plates = lbea.Model(PLATES)
        self.assertFalse(lbea.Forecast.is_in(plates))
        with self.assertRaisesRegex(lbea.Error, "no forecast"):
            lbea.Forecast(plates)
        with self.assertRaisesRegex(ValueError, "another model"):
            lbea.Forecast(lbea.Model(DEMO)).update(lbea.Matcher(plates).match(plates.node_positions(9)))


class SensorTest(unittest.TestCase):
    def test_reads_the_pose_and_the_camera(self):
        written = json.loads(Path(SENSOR).read_text())
        pose, sensor = lbea.read_pose(SENSOR), lbea.read_sensor(Path(SENSOR))
        numpy.testing.assert_allclose(pose, [*written["T_reference_sensor"], [0, 0, 0, 1]], rtol=1e-7)
        self.assertTrue((sensor["T_reference_sensor"] == pose).all())
        self.assertEqual((sensor["focal_px"], sensor["width_px"], sensor["height_px"], sensor["length_unit"]), (1350, 720, 300, "mm"))
        model = lbea.Model(DEMO)
        nodes = model.node_positions(7)
        seen = ((nodes - pose[:3, 3]) @ pose[:3, :3]).astype(numpy.float32)
        self.assertEqual(lbea.Matcher(model, T_reference_sensor=pose).match(seen).matches[0].sample, 7)

    def test_refuses_what_is_no_pose(self):
        for name, status in (("no/such/file", "file_not_found"), (__file__, "bad_input")):
            for read in (lbea.read_pose, lbea.read_sensor):
                with self.assertRaises(lbea.Error) as refused:
                    read(name)
                self.assertEqual(refused.exception.status, status)


class ThreadTest(unittest.TestCase):
    def test_matching_lets_other_threads_run(self):
        """A thread that never gives the lock away by itself would hold it for the whole, long interval."""
        model = lbea.Model(PLATES)
        for history in (None, lbea.TestHistory(model)):
            with self.subTest(history=history):
                self.check_that_others_run(model, history)

    def check_that_others_run(self, model, history):
        points, stop, matched = model.node_positions(9), threading.Event(), [0]

        def match():
            matcher = lbea.Matcher(model)
            while not stop.is_set():
                matcher.match(points, history=history)
                matched[0] += 1

        interval = sys.getswitchinterval()
        sys.setswitchinterval(60)
        try:
            worker = threading.Thread(target=match)
            begin = time.monotonic()
            worker.start()
            turns = 0
            while matched[0] < 1000 and time.monotonic() - begin < 60:
                turns += 1
                time.sleep(0)
            stop.set()
            worker.join()
        finally:
            sys.setswitchinterval(interval)
        self.assertGreater(turns, 10)
        self.assertLess(time.monotonic() - begin, 50)

    def check_that_two_threads_are_refused(self, model, matchers, history, refusal):
        outcomes, cloud = [], numpy.ascontiguousarray(numpy.tile(model.node_positions(9), (2000, 1)))

        def match(matcher):
            for _ in range(20):
                try:
                    outcomes.append(matcher.match(cloud, history=history).matches[0].sample)
                except RuntimeError as error:
                    outcomes.append(str(error) == refusal)

        threads = [threading.Thread(target=match, args=(matcher,)) for matcher in matchers]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(outcomes), 80)
        self.assertTrue(set(outcomes) <= {9, True}, set(outcomes))
        self.assertIn(9, outcomes)

    def test_one_matcher_refuses_two_threads(self):
        model = lbea.Model(PLATES)
        self.check_that_two_threads_are_refused(model, [lbea.Matcher(model, max_points=400_000)] * 4, None,
                                                "another thread is using this Matcher; create one per thread")

    def test_one_rig_matcher_refuses_two_threads(self):
        model = lbea.Model(DEMO)
        cloud, matcher, outcomes = cloud_of(sorted(Path(FRAMES).glob("*.ply"))[0]), lbea.RigMatcher(model, [lbea.read_pose(SENSOR)] * 2), []

        def match():
            for _ in range(20):
                try:
                    outcomes.append(matcher.match([cloud, cloud]).status)
                except RuntimeError as error:
                    outcomes.append(str(error))

        threads = [threading.Thread(target=match) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(outcomes), 80)
        self.assertLessEqual(set(outcomes), {"ok", "another thread is using this RigMatcher; create one per test stand"})
        self.assertIn("ok", outcomes)

    def test_one_history_refuses_two_threads(self):
        model = lbea.Model(PLATES)
        self.check_that_two_threads_are_refused(model, [lbea.Matcher(model, max_points=400_000) for _ in range(4)], lbea.TestHistory(model),
                                                "another thread is using this TestHistory; create one per test")


if __name__ == "__main__":
    unittest.main()
