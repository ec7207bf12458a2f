"""The matcher of one rig from Python."""
import gc
import json
import math
import unittest
from pathlib import Path

import numpy

import lbea

from inputs import DEMO, PLATES, SENSOR


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
