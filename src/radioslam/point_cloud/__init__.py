"""Reference paths from point clouds: key points, descriptors, registration, and a graph of what was registered."""

from radioslam.point_cloud.recordings import Recording, find_recordings
from radioslam.point_cloud.reference import ReferenceResult, make_reference
from radioslam.point_cloud.registration import Features, Registration, make_features, register

__all__ = [
    "Features",
    "Recording",
    "ReferenceResult",
    "Registration",
    "find_recordings",
    "make_features",
    "make_reference",
    "register",
]
