"""From walks to a map in Python: simulate, map, judge, look up what was heard where.

python examples/map_simulated_office.py
"""

import numpy as np

import radioslam
from radioslam.evaluation import evaluate
from radioslam.simulator import simulate

walks = simulate("office", seed=1)
result = radioslam.map_walks(walks, radioslam.load_config("default", overrides=["merging.starts=common"]))

errors = evaluate(result).total.errors
print(f"odometry alone errs {errors['odometry'].mean:.1f} m, the map {errors['estimate'].mean:.1f} m")

radio_map = result.radio_map
heard = radio_map.rss_dbm.tocsc()
most_heard = int(np.argmax(np.diff(heard.indptr)))
places = heard.indices[heard.indptr[most_heard] : heard.indptr[most_heard + 1]]
loudest = places[np.argmax(heard.data[heard.indptr[most_heard] : heard.indptr[most_heard + 1]])]
x, y = radio_map.poses[loudest, :2]
print(f"{radio_map.transmitters[most_heard]}, heard at {len(places)} places, is loudest near ({x:.0f} m, {y:.0f} m)")
