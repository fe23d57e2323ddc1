// Errors against true positions, where logs have them; and walks that the map could not take.

import { element, panel, table } from "./dom.js";
import { count, metres } from "./format.js";

const COLUMNS = ["walk", "scans", "odometry alone", "map", "map, 95 %", "map, largest"];

export class ErrorsPanel {
  constructor(model) {
    this.model = model;
    this.place = element("div", { id: "errors" });
    this.element = panel("Errors", true, this.place);
    model.addEventListener("map", () => this.fill());
    this.place.append(element("p", {}, "No map yet."));
  }

  async fill() {
    const { showing } = this.model;
    if (!this.place.querySelector("table")) this.place.replaceChildren(element("p", {}, "Loading …"));
    const errors = await this.model.view("errors").catch((error) => error);
    if (showing !== this.model.showing) return;
    const shown = errors instanceof Error || !errors
      ? [element("p", {}, errors?.status === 404 ? "The logs hold no true positions to compare with." : errors?.message ?? "No map yet.")]
      : [table("Distance to the true positions", COLUMNS, [errors.total, ...errors.walks].map(row))];
    this.place.replaceChildren(...shown, ...skipped(this.model.shown?.summary.skipped ?? []));
  }
}

function row({ name, scans, errors }) {
  const { odometry, estimate } = errors;
  return [name === "all" ? "all walks" : name, count(scans), metres(odometry.mean), metres(estimate.mean), metres(estimate.p95), metres(estimate.max)];
}

function skipped(walks) {
  if (!walks.length) return [];
  const items = walks.map(({ walk, reason }) => element("li", {}, `${walk}: ${reason}`));
  return [element("h3", {}, "Left out"), element("ul", {}, ...items)];
}
