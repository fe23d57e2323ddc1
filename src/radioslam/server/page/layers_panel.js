// Which layers are shown, how loops are coloured, and which access point's field is drawn.

import { element, labelled, panel } from "./dom.js";
import { colourings } from "./layer_loops.js";
import { describe } from "./layer_gaps.js";
import { LAYERS } from "./layers.js";

const STARTS_OPEN = "(width >= 800px)"; // on a phone it would hide all the rest

export class LayersPanel {
  constructor(model, options, onChange) {
    [this.model, this.options, this.onChange] = [model, options, onChange];
    this.legends = new Map();
    this.accessPoint = element("select", { id: "access-point", onchange: () => this.chooseAccessPoint() });
    this.gaps = element("ol", { class: "gaps" });
    this.element = panel("Layers", matchMedia(STARTS_OPEN).matches, ...LAYERS.map((layer) => this.layer(layer)));
    model.addEventListener("map", () => this.fill());
  }

  layer(layer) {
    const box = element("input", { type: "checkbox", "data-layer": layer.id, onchange: () => this.toggle(layer.id, box.checked) });
    box.checked = this.options.on.has(layer.id);
    const label = element("label", { class: "check" }, box, swatch(layer.colour), layer.label);
    const more = { heat: () => this.accessPointChooser(), loops: () => this.loopColours(), gaps: () => this.gaps }[layer.id];
    return element("div", {}, label, more ? element("div", { class: "more" }, more(), layer.legend ? this.legend(layer.id) : null) : null);
  }

  legend(id) {
    const place = element("div", { class: "legend", hidden: true });
    this.legends.set(id, place);
    return place;
  }

  accessPointChooser() {
    return labelled("Access point", this.accessPoint);
  }

  loopColours() {
    const choose = element("select", { id: "loop-colour", onchange: () => {
      this.options.loopColour = choose.value;
      this.onChange();
    } }, ...Object.entries(colourings).map(([value, { label }]) => element("option", { value }, label)));
    return labelled("Coloured by", choose);
  }

  toggle(id, isOn) {
    if (isOn) this.options.on.add(id);
    else this.options.on.delete(id);
    this.onChange();
  }

  chooseAccessPoint() {
    this.options.accessPoint = this.accessPoint.value;
    this.element.querySelector("[data-layer=heat]").checked = true;
    this.toggle("heat", true);
  }

  showLegends(legends) {
    for (const [id, place] of this.legends) {
      const legend = legends.get(id);
      place.hidden = !legend;
      if (legend) place.replaceChildren(element("span", {}, legend.low), element("span", { class: "scale", "aria-hidden": "true" }), element("span", {}, legend.high), element("span", {}, legend.label));
    }
  }

  async fill() {
    const { showing } = this.model;
    const [points, gaps] = await Promise.all(["access-points", "coverage"].map((name) => this.model.view(name).catch(() => null)));
    if (showing !== this.model.showing) return;
    this.accessPoint.replaceChildren(...(points ?? []).map((row) => element("option", { value: row.bssid }, `${row.bssid} (${row.samples} scans)`)));
    if ((points ?? []).some((row) => row.bssid === this.options.accessPoint)) this.accessPoint.value = this.options.accessPoint;
    else this.options.accessPoint = points?.[0]?.bssid ?? null;
    this.gaps.replaceChildren(...(gaps ?? []).map((row) => element("li", {}, describe(row))));
    if (this.options.on.has("heat")) this.onChange();
  }
}

function swatch(colour) {
  const made = element("span", { class: "swatch", "aria-hidden": "true" });
  if (colour) made.style.background = colour;
  return made;
}
