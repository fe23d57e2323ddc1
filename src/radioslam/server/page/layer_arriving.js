// Walks that come in now: what the map does not hold yet is laid on at the last place that it does hold.

import { ARRIVING } from "./palette.js";
import { broken, drawn, plain } from "./traces.js";

export class Arrivals {
  constructor() {
    this.walks = new Map();
  }

  takePoses({ walk, scans, poses }) {
    const known = this.walks.get(walk) ?? { poses: [], scans: 0, state: "open" };
    known.poses = [...known.poses, ...poses].sort((a, b) => a[0] - b[0]);
    known.scans += scans;
    this.walks.set(walk, known);
  }

  takeState({ walk, state }) {
    if (this.walks.has(walk)) this.walks.get(walk).state = state;
  }
}

export const arriving = {
  id: "arriving", label: "walks that come in now", colour: ARRIVING, on: true,
  load: async (model, options) => ({ mapped: (await model.view("paths")) ?? [], arrivals: options.arrivals, starts: model.info.starts, live: model.followsNewest }),
  traces({ mapped, arrivals, starts, live }) {
    if (!live) return [];
    const byName = new Map(mapped.map((walk) => [walk.walk, walk]));
    const tails = [...arrivals.walks].map(([name, walk]) => tail(name, walk, byName.get(name), starts)).filter(Boolean);
    const heads = tails.filter((line) => line.isOpen).map((line) => ({ x: line.x.slice(-1), y: line.y.slice(-1), text: line.text.slice(-1) }));
    return [
      drawn({ mode: "lines", line: { color: ARRIVING, width: 2, dash: "dot" } }, broken(tails)),
      drawn({ mode: "markers", marker: { color: ARRIVING, size: 9 } }, broken(heads)),
    ];
  },
};

// The poses after the last one in the map, moved so that both meet; null where nobody knows where they belong, and of
// walks that ended and are in the map.
function tail(name, walk, mapped, starts) {
  const tie = mapped ? tieToMap(walk.poses, mapped) : starts === "common" ? { at: walk.poses[0], pose: [0, 0, 0] } : null;
  if (!tie || (mapped && walk.state !== "open")) return null;
  const moved = walk.poses.filter((pose) => pose[0] >= tie.at[0]).map((pose) => move(pose, tie.at, tie.pose));
  if (moved.length < 2) return null;
  return { x: moved.map((p) => p[0]), y: moved.map((p) => p[1]), text: moved.map(() => `${plain(name)}<br>coming in`), isOpen: walk.state === "open" };
}

function tieToMap(poses, mapped) {
  if (mapped.map !== 0) return null;
  const last_s = mapped.time_s.at(-1);
  const at = poses.findLast((pose) => pose[0] <= last_s + 1);
  return at && at[0] > last_s - 5 ? { at, pose: mapped.estimate.at(-1) } : null;
}

// T_map_walk · pose, with T_map_walk from one pose (x, y, heading) known in both frames.
function move([, x, y], [, x0, y0, heading0], [mx, my, mheading]) {
  const turn = mheading - heading0;
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  return [mx + c * (x - x0) - s * (y - y0), my + s * (x - x0) + c * (y - y0)];
}
