// Loops: pairs of scans taken for one place, coloured by how alike they are or how far apart they ended.

import { metres } from "./format.js";
import { VIRIDIS, viridis } from "./palette.js";
import { broken, drawn, extent, plain } from "./traces.js";

const STEPS = 6;
const LARGEST_RESIDUAL = 3;

export const colourings = {
  similarity: { label: "similarity", of: (loop) => loop.similarity, range: (values) => [Math.min(extent(values)[0], 1), 1] },
  residual: {
    label: "residual over σ",
    of: (loop) => loop.apart_m / loop.sigma_m,
    range: () => [0, LARGEST_RESIDUAL],
  },
};

export const loops = {
  id: "loops", label: "loops", load: (model) => model.view("loops"),
  traces(answer, options) {
    const rows = answer ? asObjects(answer) : [];
    if (!rows.length) return [];
    const { of, range } = colourings[options.loopColour];
    const [low, high] = range(rows.map(of));
    const part = (loop) => Math.min(Math.max((of(loop) - low) / (high - low || 1), 0), 1);
    return [...segments(rows, part), middles(rows, part)];
  },
  legend(answer, options) {
    const rows = answer ? asObjects(answer) : [];
    const { label, of, range } = colourings[options.loopColour];
    const [low, high] = range(rows.map(of));
    return { label, low: low.toFixed(2), high: options.loopColour === "residual" ? `≥ ${high}` : high.toFixed(2) };
  },
};

function asObjects({ columns, rows, walks }) {
  return rows.map((row) => {
    const loop = Object.fromEntries(columns.map((name, k) => [name, row[k]]));
    return { ...loop, walks: [walks[loop.walk_i], walks[loop.walk_j]] };
  });
}

// A line has one colour, so there are as many lines as steps of the scale.
function segments(rows, part) {
  return Array.from({ length: STEPS }, (_, step) => {
    const here = rows.filter((loop) => Math.min(Math.floor(part(loop) * STEPS), STEPS - 1) === step);
    const lines = here.map((loop) => ({ x: [loop.x_i_m, loop.x_j_m], y: [loop.y_i_m, loop.y_j_m] }));
    return drawn({ mode: "lines", line: { color: viridis((step + 0.5) / STEPS), width: 1.5 }, hoverinfo: "skip", hovertemplate: null }, broken(lines));
  });
}

function middles(rows, part) {
  const marker = { color: rows.map(part), colorscale: VIRIDIS, cmin: 0, cmax: 1, size: 5, symbol: "diamond", showscale: false };
  return drawn({ mode: "markers", marker }, {
    x: rows.map((loop) => (loop.x_i_m + loop.x_j_m) / 2),
    y: rows.map((loop) => (loop.y_i_m + loop.y_j_m) / 2),
    text: rows.map((loop) => `loop<br>${loop.walks.map(plain).join("<br>")}<br>similarity ${loop.similarity.toFixed(2)}, σ ${metres(loop.sigma_m)}, ${metres(loop.apart_m)} apart`),
  });
}
