// The strength that the map expects of one access point at any place.

import { VIRIDIS } from "./palette.js";
import { extent, plain } from "./traces.js";

const HEARD = 0.5; // below, most scans do not hear it

export const heat = {
  id: "heat", label: "radio of one access point",
  async load(model, options) {
    if (!options.accessPoint || !model.shown) return null;
    try {
      return await model.view("heat", { access_point: options.accessPoint });
    } catch (error) {
      if (error.status === 404) return null; // an older version may not have heard it yet
      throw error;
    }
  },
  traces(answer, options) {
    const heard = heardRows(answer);
    return heard.length ? [heatmap(heard, answer.cell_m, options.accessPoint)] : [];
  },
  legend(answer, options) {
    const heard = heardRows(answer);
    if (!heard.length) return { label: options.accessPoint ? "not heard in this version" : "choose an access point", low: "", high: "" };
    const [low, high] = extent(heard.map((row) => row[2])).map((value) => value.toFixed(0));
    return { label: "dBm", low, high };
  },
};

function heardRows(answer) {
  return (answer?.rows ?? []).filter((row) => row[4] >= HEARD);
}

function heatmap(rows, cell_m, name) {
  const [x, y] = [axis(rows, 0, cell_m), axis(rows, 1, cell_m)];
  const empty = () => y.map(() => x.map(() => null));
  const [z, text] = [empty(), empty()];
  for (const [px, py, mean, sigma, detection] of rows) {
    const [i, j] = [Math.round((py - y[0]) / cell_m), Math.round((px - x[0]) / cell_m)];
    z[i][j] = mean;
    text[i][j] = `${plain(name)}<br>${mean.toFixed(0)} dBm, σ ${sigma.toFixed(1)} dB<br>heard by ${(100 * detection).toFixed(0)} % of scans`;
  }
  return { type: "heatmap", x, y, z, text, colorscale: VIRIDIS, showscale: false, opacity: 0.75, hoverongaps: false, hovertemplate: "%{text}<extra></extra>" };
}

function axis(rows, column, cell_m) {
  const [low, high] = extent(rows.map((row) => row[column]));
  const steps = Math.round((high - low) / cell_m) + 1;
  return Array.from({ length: steps }, (_, k) => low + k * cell_m);
}
