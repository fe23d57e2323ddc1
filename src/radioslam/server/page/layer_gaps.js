// Where the map knows least: walk here next.

import { decibels, place } from "./format.js";
import { GAP } from "./palette.js";
import { drawn } from "./traces.js";

export const gaps = {
  id: "gaps", label: "walk here next", colour: GAP,
  load: (model) => model.view("coverage"),
  traces(rows) {
    const marker = { color: "#fff", size: 20, line: { color: GAP, width: 2 } };
    return [drawn({ mode: "markers+text", marker, textfont: { color: GAP, size: 12 }, hovertemplate: "%{customdata}<extra></extra>" }, {
      x: (rows ?? []).map((row) => row[0]),
      y: (rows ?? []).map((row) => row[1]),
      text: (rows ?? []).map((_, k) => String(k + 1)),
      customdata: (rows ?? []).map((row) => `walk here next<br>${describe(row)}`),
    })];
  },
};

export function describe([x, y, sigma_db]) {
  return `${place(x, y)}: strengths uncertain by ${decibels(sigma_db)}`;
}
