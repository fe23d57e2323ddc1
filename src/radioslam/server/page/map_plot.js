// The plan; the one file that knows Plotly. The view that somebody chose stays while the map grows.

/* global Plotly */

const AXIS = { ticksuffix: " m", zeroline: false, gridcolor: "#e4e5e9", automargin: true };
const CONFIG = { responsive: true, scrollZoom: true, displayModeBar: false, doubleClick: false };
const STEP = 0.2;
const KEYS = {
  ArrowLeft: [-STEP, 0, 1], ArrowRight: [STEP, 0, 1], ArrowUp: [0, STEP, 1], ArrowDown: [0, -STEP, 1],
  "+": [0, 0, 0.7], "=": [0, 0, 0.7], "-": [0, 0, 1 / 0.7],
};

export class MapPlot {
  constructor(place) {
    this.place = place;
    this.ranges = null; // as chosen by hand; else all is shown
    place.addEventListener("keydown", (event) => this.key(event));
  }

  async draw(traces, images) {
    await Plotly.react(this.place, traces, this.layout(images), CONFIG);
    if (this.listens) return;
    this.listens = true;
    this.place.on("plotly_relayout", (change) => this.remember(change));
    this.place.on("plotly_doubleclick", () => this.fit());
  }

  layout(images) {
    const [x, y] = this.ranges ?? [null, null];
    const range = (chosen) => (chosen ? { range: chosen, autorange: false } : { autorange: true });
    return {
      xaxis: { ...AXIS, ...range(x) },
      yaxis: { ...AXIS, ...range(y), scaleanchor: "x" },
      images, showlegend: false, hovermode: "closest", dragmode: "pan",
      margin: { l: 8, r: 8, t: 8, b: 8 }, font: { family: "system-ui, Roboto, Helvetica, Arial, sans-serif" },
    };
  }

  remember(change) {
    if (Object.keys(change).some((name) => /^[xy]axis\.range/.test(name))) this.ranges = this.now();
  }

  now() {
    return ["xaxis", "yaxis"].map((axis) => [...this.place.layout[axis].range]);
  }

  // Move by parts of what is seen, and zoom about its middle.
  look(right, up, factor) {
    if (!this.place.layout) return;
    const moved = this.now().map(([low, high], k) => {
      const [middle, half] = [(low + high) / 2 + [right, up][k] * (high - low), ((high - low) / 2) * factor];
      return [middle - half, middle + half];
    });
    this.ranges = moved;
    Plotly.relayout(this.place, { "xaxis.range": moved[0], "yaxis.range": moved[1] });
  }

  fit() {
    this.ranges = null;
    if (this.place.layout) Plotly.relayout(this.place, { "xaxis.autorange": true, "yaxis.autorange": true });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "0") this.fit();
    else if (KEYS[event.key]) this.look(...KEYS[event.key]);
    else return;
    event.preventDefault();
  }

  leave() {
    Plotly.purge(this.place);
  }
}
