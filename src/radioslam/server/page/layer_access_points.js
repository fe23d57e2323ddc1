// Where access points stand, as far as the map can tell.

import { drawn, plain } from "./traces.js";

const INK = "#0b6e4f";

export const accessPoints = {
  id: "access-points", label: "access points", colour: INK,
  load: (model) => model.view("access-points"),
  traces(rows) {
    const placed = (rows ?? []).filter((row) => row.x_m !== "");
    return [drawn({ mode: "markers", marker: { color: INK, size: 9, symbol: "triangle-up" } }, {
      x: placed.map((row) => Number(row.x_m)),
      y: placed.map((row) => Number(row.y_m)),
      text: placed.map((row) => `${plain(row.bssid)}<br>σ ${row.sigma_m} m, ${row.samples} scans<br>${plain(row.health)}`),
    })];
  },
};
