// Walks before, after, and where people really went.

import { metres } from "./format.js";
import { ODOMETRY, TRUTH, WALKS } from "./palette.js";
import { broken, drawn, ellipse, plain } from "./traces.js";

const MOST_CIRCLES = 1500;
const tied = (walks) => (walks ?? []).filter((walk) => walk.map === 0);
const walksOf = (model) => model.view("paths");

export const odometry = {
  id: "odometry", label: "before: odometry alone", colour: ODOMETRY, load: walksOf,
  traces(walks) {
    const lines = tied(walks).map((walk) => line(walk, walk.odometry));
    return [drawn({ mode: "lines", line: { color: ODOMETRY, width: 1 }, opacity: 0.8 }, broken(lines))];
  },
};

export const estimate = {
  id: "estimate", label: "after: the paths of the map", colour: WALKS[0], on: true, load: walksOf,
  traces(walks) {
    return WALKS.map((color, k) => {
      const lines = (walks ?? []).flatMap((walk, n) => (walk.map === 0 && n % WALKS.length === k ? [line(walk, walk.estimate)] : []));
      return drawn({ mode: "lines+markers", line: { color, width: 2 }, marker: { color, size: 4 } }, broken(lines));
    });
  },
};

export const truth = {
  id: "truth", label: "truth, where the logs tell it", colour: TRUTH, load: walksOf,
  traces(walks) {
    const lines = tied(walks).filter((walk) => walk.reference).map((walk) => line(walk, walk.reference));
    return [drawn({ mode: "lines", line: { color: TRUTH, width: 1.2 } }, broken(lines))];
  },
};

export const untied = {
  id: "untied", label: "walks not tied, in own frames", colour: WALKS[5], load: walksOf,
  traces(walks) {
    const lines = (walks ?? []).filter((walk) => walk.map > 0).map((walk) => line(walk, walk.estimate));
    return [drawn({ mode: "lines", line: { color: WALKS[5], width: 1.5, dash: "dot" } }, broken(lines))];
  },
};

export const sigma = {
  id: "sigma", label: "uncertainty: σ of positions", colour: "#8fb4e6", load: walksOf,
  traces(walks) {
    const points = tied(walks).flatMap((walk) => walk.estimate.map(([x, y], k) => [x, y, walk.sigma_m[k]]));
    const known = points.filter(([, , sigma_m]) => sigma_m !== null);
    const step = Math.max(1, Math.ceil(known.length / MOST_CIRCLES));
    const circles = known.filter((_, k) => k % step === 0).map(([x, y, r]) => ellipse(x, y, r, r));
    return [drawn({ mode: "lines", line: { color: WALKS[0], width: 0.7 }, opacity: 0.45, hoverinfo: "skip", hovertemplate: null }, broken(circles))];
  },
};

function line(walk, rows) {
  const name = plain(walk.walk);
  const text = rows.map(([x, y], k) =>
    x === null ? "" : `${name}<br>${(walk.time_s[k] - walk.time_s[0]).toFixed(0)} s, σ ${metres(walk.sigma_m[k])}<br>x ${metres(x)}, y ${metres(y)}`);
  return { x: rows.map((row) => row[0]), y: rows.map((row) => row[1]), text };
}
