// The map's versions as a slider over time, and the floor.

import { element, labelled } from "./dom.js";
import { clock, many } from "./format.js";

export class VersionsPanel {
  constructor(model) {
    this.model = model;
    this.slider = element("input", { type: "range", min: "0", step: "1", id: "version", oninput: () => this.slid() });
    this.told = element("output", { for: "version" });
    this.floor = element("select", { id: "floor", onchange: () => model.choose(model.shown, this.floor.value) });
    this.floorLabel = labelled("Floor", this.floor);
    this.element = element("section", { class: "versions", "aria-label": "Versions of the map" }, labelled("Version", this.slider), this.told, this.floorLabel);
    model.addEventListener("versions", () => this.show());
    this.show();
  }

  slid() {
    this.model.choose(this.model.versions[Number(this.slider.value)]);
  }

  show() {
    const { versions, shown, newest } = this.model;
    this.slider.max = String(Math.max(versions.length - 1, 0));
    this.slider.value = String(Math.max(versions.indexOf(shown), 0));
    this.slider.disabled = versions.length < 2;
    this.told.textContent = shown ? describe(shown, shown === newest) : "no map yet: it is made once walks came in";
    this.slider.setAttribute("aria-valuetext", this.told.textContent);
    this.showFloors();
  }

  showFloors() {
    const names = this.model.floors.map((one) => one.floor);
    this.floor.replaceChildren(...names.map((name) => element("option", { value: name }, name || "(no name)")));
    if (this.model.floor !== null) this.floor.value = this.model.floor;
    this.floorLabel.hidden = names.length < 2;
  }
}

function describe(one, isNewest) {
  const floors = one.summary.floors;
  const sum = (of) => floors.reduce((total, floor) => total + (of(floor) ?? 0), 0);
  const loops = sum((floor) => floor.loops?.kept);
  const how = one.summary.made === "grown" ? "grown" : "of all walks";
  return `${one.version}${isNewest ? " (newest)" : ""}, ${how}, ${clock(one.made_s)}, ${many(loops, "loop")}`;
}
