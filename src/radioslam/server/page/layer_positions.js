// Those who ask where they are, with the region that holds the truth with 95 %.

import { metres, place } from "./format.js";
import { POSITION } from "./palette.js";
import { broken, drawn, ellipse, plain } from "./traces.js";

const SHOWN_S = 300;
const MOST_SHOWN = 50;
const PER_SIGMA = Math.sqrt(-2 * Math.log(0.05)); // 95 % of a Gaussian in the plane

export class Positions {
  constructor() {
    this.known = new Map();
    this.single = 0;
  }

  // A followed phone has one place, and each single scan one of its own.
  take(told) {
    const name = told.session || `scan ${++this.single}`;
    this.known.delete(name);
    this.known.set(name, told);
    if (this.known.size > MOST_SHOWN) this.known.delete(this.known.keys().next().value);
  }

  recent(floor) {
    const since_s = Date.now() / 1000 - SHOWN_S;
    return [...this.known].filter(([, told]) => told.time_s > since_s && (!told.floor || !floor || told.floor === floor));
  }
}

export const positions = {
  id: "positions", label: "who asked in the last 5 minutes", colour: POSITION, on: true,
  load: async (model, options) => options.positions.recent(model.floor),
  traces(recent) {
    const rings = recent.map(([, p]) => ellipse(p.x_m, p.y_m, PER_SIGMA * p.sigma_x_m, PER_SIGMA * p.sigma_y_m));
    const marker = { color: POSITION, size: 12, symbol: "star", line: { color: "#fff", width: 1 } };
    return [
      drawn({ mode: "lines", line: { color: POSITION, width: 1.5 }, fill: "toself", fillcolor: "rgba(122,31,162,0.1)", hoverinfo: "skip", hovertemplate: null }, broken(rings)),
      drawn({ mode: "markers", marker }, {
        x: recent.map(([, p]) => p.x_m),
        y: recent.map(([, p]) => p.y_m),
        text: recent.map(([name, p]) => `${plain(name)}<br>${place(p.x_m, p.y_m)}<br>within ${metres(p.radius_m)} with 95 %`),
      }),
    ];
  },
};
