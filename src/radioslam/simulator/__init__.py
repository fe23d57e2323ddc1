"""Seeded buildings, access points and walkers: data with a known truth, in the form of recorded walks."""

from radioslam.simulator.scenarios import SCENARIOS, Scenario
from radioslam.simulator.survey import simulate
from radioslam.simulator.tracker import WIFINE_DRIFT, TrackerDrift, with_tracker_drift

__all__ = ["SCENARIOS", "WIFINE_DRIFT", "Scenario", "TrackerDrift", "simulate", "with_tracker_drift"]
