// One site: the live map and what belongs to it, as far as the key's role reaches.

import { getJson } from "./api.js";
import { downloadPanel } from "./download_panel.js";
import { element } from "./dom.js";
import { ErrorsPanel } from "./errors_panel.js";
import { watchEvents } from "./event_stream.js";
import { Arrivals } from "./layer_arriving.js";
import { Positions } from "./layer_positions.js";
import { LAYERS } from "./layers.js";
import { LayersPanel } from "./layers_panel.js";
import { LocatePanel } from "./locate_panel.js";
import { MapView } from "./map_view.js";
import { loadPlan, planPanel } from "./plan_panel.js";
import { SiteModel } from "./site_model.js";
import { StatusPanel } from "./status_panel.js";
import { UploadPanel } from "./upload_panel.js";
import { VersionsPanel } from "./versions_panel.js";
import { WalksPanel } from "./walks_panel.js";

export async function showSite(id, caller) {
  const model = new SiteModel(await getJson(`sites/${encodeURIComponent(id)}`));
  const title = model.info.title || model.info.id;
  const heading = element("h1", {}, title);
  if (caller.role === "upload") return { title, elements: [heading, ...uploaderParts(model)], leave() {} };
  const view = new SiteView(model, caller);
  await view.begin();
  return { title, elements: [heading, view.element], leave: () => view.leave() };
}

function uploaderParts(model) {
  const upload = new UploadPanel(model, () => {});
  upload.element.open = true;
  return [element("p", {}, "This key may upload walks; to see the map takes one with the role read."), upload.element];
}

class SiteView {
  constructor(model, caller) {
    this.model = model;
    this.isAdmin = caller.role === "admin";
    this.options = { on: new Set(LAYERS.filter((layer) => layer.on).map((layer) => layer.id)), loopColour: "similarity", accessPoint: null, arrivals: new Arrivals(), positions: new Positions() };
    this.map = new MapView(model, this.options);
    this.layers = new LayersPanel(model, this.options, () => this.map.draw());
    this.map.onLegends = (legends) => this.layers.showLegends(legends);
    this.status = new StatusPanel(model, this.options.arrivals, caller);
    this.walks = new WalksPanel(model, caller);
    model.addEventListener("map", () => this.map.draw());
    this.element = this.lay();
  }

  lay() {
    const main = element("div", { class: "stage" }, this.map.element, new VersionsPanel(this.model).element, new ErrorsPanel(this.model).element, this.walks.element);
    const admin = this.isAdmin ? [new UploadPanel(this.model, () => this.walks.refresh()).element, planPanel(this.model, () => this.changePlan())] : [];
    const side = element("div", { class: "side" }, this.status.element, this.layers.element, new LocatePanel(this.model).element, downloadPanel(this.model), ...admin);
    return element("div", { class: "site" }, main, side);
  }

  async begin() {
    await Promise.all([this.model.refreshVersions(), this.status.refresh(), this.walks.refresh(), this.showPlan()]);
    this.map.draw();
    this.stop = watchEvents(`${this.model.path}/events`, (kind, data) => this.take(kind, data), (state) => this.heard(state));
  }

  // What happened while nobody listened is asked for.
  heard(state) {
    this.status.showStream(state);
    if (state !== "live") return;
    this.soon("versions", () => this.model.refreshVersions());
    this.soon("walks", () => this.walks.refresh());
    this.soon("build", () => this.status.refresh());
  }

  async changePlan() {
    await this.model.refreshInfo();
    await this.showPlan();
    this.map.draw();
  }

  async showPlan() {
    this.map.images = await loadPlan(this.model);
  }

  take(kind, data) {
    const { arrivals, positions } = this.options;
    if (kind === "poses") arrivals.takePoses(data);
    else if (kind === "walk") arrivals.takeState(data);
    else if (kind === "position") positions.take(data);
    if (kind === "poses" || kind === "walk") this.status.showArrivals();
    if (kind === "build") this.status.showBuild(data);
    if (kind === "walk") this.soon("walks", () => this.walks.refresh());
    if (kind === "map") this.soon("versions", () => this.model.refreshVersions());
    if (kind === "poses" || kind === "position") this.map.draw();
  }

  // Many events at once ask only once.
  soon(name, ask) {
    this.waiting ??= new Map();
    clearTimeout(this.waiting.get(name));
    this.waiting.set(name, setTimeout(() => ask().catch((error) => this.status.showStream(error.message)), 200));
  }

  leave() {
    this.stop?.();
    for (const timer of this.waiting?.values() ?? []) clearTimeout(timer);
    this.map.leave();
  }
}
