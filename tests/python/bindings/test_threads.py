"""Matching lets other threads run, which may not use the same objects."""
import sys
import threading
import time
import unittest
from pathlib import Path

import numpy

import lbea

from inputs import DEMO, FRAMES, PLATES, SENSOR, cloud_of


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
