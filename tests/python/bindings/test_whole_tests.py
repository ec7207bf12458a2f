"""The history of a test, several rigs and forecasts from Python."""
import unittest
from pathlib import Path

import numpy

import lbea

from inputs import DEMO, FRAMES, PLATES, SENSOR, cloud_of


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
