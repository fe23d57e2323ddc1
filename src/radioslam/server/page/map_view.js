// The plan with its layers: gathers what the chosen layers show and draws it, one drawing after another.

import { button, element } from "./dom.js";
import { LOWEST_FIRST } from "./layers.js";
import { MapPlot } from "./map_plot.js";

export class MapView {
  constructor(model, options) {
    [this.model, this.options] = [model, options];
    this.place = element("div", { class: "map", tabindex: "0", role: "application",
      "aria-label": "Map. Arrow keys move it, plus and minus zoom, 0 shows all." });
    this.problem = element("p", { class: "problem", role: "alert" });
    this.plot = new MapPlot(this.place);
    this.images = [];
    this.wanted = false;
    this.element = element("section", { class: "plan", "aria-label": "Map" }, this.place, this.buttons(), this.problem);
  }

  buttons() {
    return element("div", { class: "zoom" },
      button("+", () => this.plot.look(0, 0, 0.7), { "aria-label": "Zoom in" }),
      button("−", () => this.plot.look(0, 0, 1 / 0.7), { "aria-label": "Zoom out" }),
      button("⤢", () => this.plot.fit(), { "aria-label": "Show all" }));
  }

  // Draw soon; what is asked for while it draws makes it draw once more.
  async draw() {
    if (this.drawing) {
      this.wanted = true;
      return;
    }
    this.drawing = true;
    do {
      this.wanted = false;
      await this.drawOnce();
      await new Promise((done) => setTimeout(done, 50));
    } while (this.wanted && !this.left);
    this.drawing = false;
  }

  async drawOnce() {
    try {
      const chosen = LOWEST_FIRST.filter((layer) => this.options.on.has(layer.id));
      const contents = await Promise.all(chosen.map((layer) => layer.load(this.model, this.options)));
      if (this.left) return;
      await this.plot.draw(chosen.flatMap((layer, k) => layer.traces(contents[k], this.options)), this.images);
      this.problem.textContent = "";
      this.onLegends?.(new Map(chosen.map((layer, k) => [layer.id, layer.legend?.(contents[k], this.options)])));
    } catch (error) {
      this.problem.textContent = error.message;
    }
  }

  leave() {
    this.left = true;
    this.plot.leave();
  }
}
